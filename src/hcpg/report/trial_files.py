"""The table of all trials in some folders, written as files, and its figure."""

from collections.abc import Sequence
from pathlib import Path

from hcpg.report.checkout import commit_text, own_code
from hcpg.report.pictures import save
from hcpg.report.provenance import Provenance
from hcpg.report.styles import drawing
from hcpg.report.trial_figure import trial_figure
from hcpg.report.trial_forms import as_csv, caption, contrasts_csv, latex, markdown
from hcpg.report.trial_records import Study
from hcpg.report.trial_table import trial_table


def write_tables(studies: Sequence[Study], out: Path, command: str) -> tuple[str, list[Path]]:
    """Write `trials.md`, `.tex`, `.csv` and `trial_differences.csv` into `out`; gives the text and the files.

    Raises:
        RecordError: there are no trials, or a twin's and an arm's are mixed.
    """
    table = trial_table(studies)
    texts = {
        "trials.md": f"{markdown(table, studies)}\nmade by: {command}\n",
        "trials.tex": f"% made by: {command}\n{latex(table)}",
        "trials.csv": as_csv(table),
        "trial_differences.csv": contrasts_csv(table),
    }
    out.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (out / name).write_text(text)
    return texts["trials.md"], [out / name for name in texts]


def write_figure(studies: Sequence[Study], out: Path, command: str) -> list[Path]:
    """Write the figure `trials` with its caption into `out`; gives its files.

    Raises:
        RecordError: there are no trials, or a twin's and an arm's are mixed.
        MissingExtraError: matplotlib is not installed.
    """
    table = trial_table(studies)
    plans = {study.plan["task"]: study.digest for study in studies}
    with drawing():
        figure = trial_figure(table)
    return save(figure, out / "trials", caption(table), Provenance(command, commit_text(own_code()), plans))
