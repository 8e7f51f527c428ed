"""All figures of a report, each written with its caption and provenance."""

from collections.abc import Sequence
from pathlib import Path

from hcpg.report import bars, figures, progress
from hcpg.report.pictures import save
from hcpg.report.provenance import Provenance, provenance
from hcpg.report.records import Group


def write_figures(groups: Sequence[Group], folder: Path, command: str) -> list[Path]:
    """Write every figure that `groups` allow into `folder`; gives the paths.

    Raises:
        MissingExtraError: matplotlib is not installed.
        RecordError: the groups of a suite mix protocols.
        StatisticsError: a run has fewer than five evaluations.
    """
    origin = provenance(groups, command)
    written = save(figures.learning_curves(groups), folder / "curves", figures.CAPTION, origin)
    for suite, own in bars.suites_of(groups).items():
        caption = bars.CAPTION.format(suite=suite)
        written += save(bars.success_bars(own), folder / f"bars_{suite}", caption, provenance(own, command))
    return written + _progress(groups, folder, origin)


def _progress(groups: Sequence[Group], folder: Path, origin: Provenance) -> list[Path]:
    return save(progress.progress_figure(groups), folder / "progress", progress.CAPTION, origin)
