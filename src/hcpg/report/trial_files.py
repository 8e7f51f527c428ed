"""The table of all trials in a folder, written as files."""

from pathlib import Path

from hcpg.report.trial_forms import as_csv, contrasts_csv, latex, markdown
from hcpg.report.trial_records import find_studies
from hcpg.report.trial_table import trial_table


def write_tables(root: Path, out: Path, command: str) -> tuple[str, list[Path]]:
    """Write `trials.md`, `.tex`, `.csv` and `trial_differences.csv` into `out`; gives the text and the files.

    Raises:
        RecordError: there are no trials under `root`, they are damaged, or a twin's and an arm's are mixed.
    """
    studies = find_studies(root)
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
