"""Learning progress of a suite: success over the normalised budget, its tasks averaged within each seed.

Source: paper, the figure of simulation learning progress.
"""

import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hcpg.report.bars import ordered, suites_of
from hcpg.report.paper_tables import method_name
from hcpg.report.records import Group, RecordError
from hcpg.report.styles import COLUMN_IN, PAGE_IN, Style, blank, drawing, styles_of
from hcpg.types import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CAPTION = (
    "Learning progress by suite. Within each seed, success is averaged over all tasks of the suite after "
    "linearly aligning their normalised training budgets; lines are means over seeds, shaded regions ±1 "
    "sample SD. Methods that lack a task of the suite are not shown."
)
COLUMN_PANELS = 2
_LOG = logging.getLogger(__name__)


class Profile(NamedTuple):
    """One method's progress on a suite."""

    budget: Float[np.ndarray, " G"]
    """Share of the training budget, in (0, 1]."""
    success: Float[np.ndarray, "S G"]
    """Percent, mean over tasks, by seed."""


def profiles(groups: Sequence[Group]) -> dict[str, Profile]:
    """The progress of every preset that has all tasks of `groups`, which are those of one suite.

    Raises:
        RecordError: a preset's tasks have different seeds, or seeds without a common evaluation.
    """
    tasks = {group.task for group in groups}
    found = {}
    for preset in ordered([group.preset for group in groups]):
        own = [group for group in groups if group.preset == preset]
        lacking = tasks - {group.task for group in own}
        if lacking:
            _LOG.warning("left %s out of the progress: it lacks %s", preset, ", ".join(sorted(lacking)))
            continue
        found[preset] = _profile(own)
    return found


def _profile(groups: Sequence[Group]) -> Profile:
    """One preset's groups, one per task."""
    seeds = {tuple(run.seed for run in group.runs) for group in groups}
    if len(seeds) > 1:
        raise RecordError(
            f"{groups[0].preset}: its tasks have different seeds ({sorted(seeds)}), so no seed can be "
            "averaged over tasks. Finish the runs, or report the tasks apart."
        )
    curves = [group.curve(group.selector) for group in groups]
    if any(curve is None or not curve.steps.size for curve in curves):
        raise RecordError(f"{groups[0].preset}: seeds without an evaluation in common. Train on.")
    shares = [curve.steps / curve.steps[-1] for curve in curves if curve is not None]
    begin = max(share[0] for share in shares)
    budget = np.unique(np.concatenate(shares).round(9))
    budget = budget[budget >= begin - 1e-9]
    aligned = [
        [np.interp(budget, share, rates) for rates in curve.rates]
        for share, curve in zip(shares, curves, strict=True)
        if curve is not None
    ]
    return Profile(budget, 100 * np.mean(aligned, axis=0))


def progress_figure(groups: Sequence[Group]) -> "Figure | None":
    """A panel per suite, one column wide for one or two; None where no preset has all tasks of any suite.

    Raises:
        RecordError: a preset's tasks have different seeds.
        StyleError: more presets than can be told apart.
    """
    suites = {name: profiles(own) for name, own in suites_of(groups).items()}
    suites = {name: own for name, own in suites.items() if own}
    if not suites:
        return None
    styles = styles_of(ordered([preset for own in suites.values() for preset in own]))
    with drawing():
        width_in = COLUMN_IN if len(suites) <= COLUMN_PANELS else PAGE_IN
        figure = blank(width_in, 2.2)
        panels = figure.subplots(1, len(suites), sharey=True, squeeze=False)[0]
        for panel, (name, own) in zip(panels, suites.items(), strict=True):
            _panel(panel, own, styles)
            panel.set_title(name)
        panels[0].set_ylabel("success over tasks, %")
        lines = {line.get_label(): line for panel in panels for line in panel.get_lines()}
        labels = [method_name(preset) for preset in styles]
        handles = [lines[label] for label in labels]
        figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, handlelength=3)
    return figure


def _panel(panel: "Axes", own: Mapping[str, Profile], styles: Mapping[str, Style]) -> None:
    for preset, profile in own.items():
        style, percent = styles[preset], 100 * profile.budget
        mean = profile.success.mean(axis=0)
        panel.plot(
            percent, mean, color=style.color, linestyle=style.line, marker=style.marker, markersize=3.4,
            markeredgewidth=0, linewidth=1.1, label=method_name(preset), zorder=3,
        )  # fmt: skip
        if len(profile.success) > 1:
            deviation = profile.success.std(axis=0, ddof=1)
            panel.fill_between(
                percent, mean - deviation, mean + deviation, color=style.color, alpha=0.18, linewidth=0
            )
    panel.set_xlabel("training budget, %")
    panel.set_xlim(0, 101)
    panel.set_ylim(-4, 104)
    panel.grid(color="0.88", linewidth=0.5)
