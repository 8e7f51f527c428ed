"""The figures in the repository: every stored table is what the stored rows say, and names its command."""

import gzip
import re
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


def test_nothing_stored_names_a_place_of_the_machine_that_made_it():
    folders, kinds = (EVIDENCE, EVIDENCE.parents[1] / "results"), {".json", ".jsonl", ".gz"}
    files = [file for folder in folders for file in folder.rglob("*") if file.suffix in kinds]
    assert len(files) > 500
    for file in files:
        content = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
        found = re.search(rb'["\s](/\w[\w.-]*/[^"\s]*)', content)
        assert found is None, (file, found)
