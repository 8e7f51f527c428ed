"""All figures of a report, each written with its caption and provenance."""

import logging
from collections.abc import Sequence
from pathlib import Path

from hcpg.report import ablation_figures, bars, figures, learning_progress, strips
from hcpg.report.ablation import ablated, candidate_table
from hcpg.report.pictures import save
from hcpg.report.provenance import provenance
from hcpg.report.records import Group

MOST_TASKS = 12
_LOG = logging.getLogger(__name__)


def write_figures(groups: Sequence[Group], folder: Path, command: str) -> list[Path]:
    """Write every figure that `groups` allow into `folder`; gives the paths.

    Raises:
        MissingExtraError: matplotlib is not installed.
        RecordError: the groups of a suite mix protocols.
        StatisticsError: a run has fewer than five evaluations.
    """
    origin, written = provenance(groups, command), []
    if _fits("curves", groups):
        written += save(figures.learning_curves(groups), folder / "curves", figures.CAPTION, origin)
    for suite, own in bars.suites_of(groups).items():
        caption, name = bars.CAPTION.format(suite=suite), f"bars_{suite}"
        if _fits(name, own):
            written += save(bars.success_bars(own), folder / name, caption, provenance(own, command))
    averaged = learning_progress.progress_figure(groups)
    if averaged is not None:
        written += save(averaged, folder / "progress", learning_progress.CAPTION, origin)
    written += _strips(groups, folder, command)
    return written + _ablation(ablated(groups), folder, command)


def _fits(name: str, groups: Sequence[Group]) -> bool:
    """Whether a page can hold a picture with a place for every task; says so where it cannot."""
    tasks = len({group.task for group in groups})
    if tasks > MOST_TASKS:
        _LOG.warning(
            "left out the picture %s: a page holds %d tasks, not %d. Choose some with --tasks.",
            name,
            MOST_TASKS,
            tasks,
        )
    return tasks <= MOST_TASKS


def strips_of(groups: Sequence[Group]) -> list[tuple[Group, strips.Strip]]:
    """A strip per task of which a run has one, ours before others, each with the runs it is from."""
    chosen: dict[str, tuple[Group, strips.Strip]] = {}
    for group in sorted(groups, key=lambda group: group.preset != strips.FIRST):
        found = strips.find_strips(run.path for run in group.runs)
        if found and group.task not in chosen:
            chosen[group.task] = (group, strips.read_strip(found[0]))
    return [chosen[task] for task in sorted(chosen)]


def _strips(groups: Sequence[Group], folder: Path, command: str) -> list[Path]:
    """The picture of the rollouts; none without a strip."""
    pairs = strips_of(groups)
    if not pairs:
        return []
    episodes = "; ".join(strip.title for _, strip in pairs)
    figure = strips.rollout_strips([strip for _, strip in pairs])
    origin = provenance([group for group, _ in pairs], command)
    return save(figure, folder / "rollouts", strips.CAPTION.format(episodes=episodes), origin)


def _ablation(groups: Sequence[Group], folder: Path, command: str) -> list[Path]:
    """The pictures of the ablation; none where no arm was run."""
    if not groups:
        return []
    origin = provenance(groups, command)
    caption = ablation_figures.CAPTION.format(tasks=origin.facts["tasks"])
    written = save(ablation_figures.ablation_figure(groups), folder / "ablation", caption, origin)
    if candidate_table(groups) is None:
        return written
    caption = ablation_figures.CANDIDATES_CAPTION
    return written + save(ablation_figures.candidates_figure(groups), folder / "candidates", caption, origin)
