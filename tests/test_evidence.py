"""The figures in the repository: every stored table is what the stored rows say, and names its command."""

from pathlib import Path

import pytest

from hcpg.report.records import load_runs
from hcpg.report.tables import markdown

EVIDENCE = Path(__file__).parents[1] / "docs/evidence"
# Some have a row per run, not a table of seeds.
STORED = sorted(path.parent for path in EVIDENCE.glob("*/README.md") if "| seeds " in path.read_text())


@pytest.mark.parametrize("folder", STORED, ids=lambda folder: folder.name)
def test_a_stored_table_follows_from_the_stored_rows(folder):
    text, groups = (folder / "README.md").read_text(), load_runs([folder / "runs"])
    assert markdown(groups) in text
    for group in groups:
        seeds = " ".join(str(run.seed) for run in group.runs)
        commands = [line for line in text.splitlines() if line.startswith("hcpg train ")]
        named = f"--task {group.task} --preset {group.preset} "
        assert sum(named in line and line.endswith(f"--seeds {seeds}") for line in commands) == 1


def test_there_is_evidence():
    assert STORED
