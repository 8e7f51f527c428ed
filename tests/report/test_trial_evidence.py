"""The trials in the repository: every stored table is what the stored ledgers say."""

from pathlib import Path

import pytest

from hcpg.report.trial_files import write_tables
from hcpg.report.trial_records import find_studies

EVIDENCE = Path(__file__).parents[2] / "docs/evidence"
STORED = sorted(path.parent for path in EVIDENCE.glob("**/trials.md"))


@pytest.mark.parametrize("folder", STORED, ids=lambda folder: str(folder.relative_to(EVIDENCE)))
def test_a_stored_table_follows_from_the_stored_ledgers(folder, tmp_path):
    studies = find_studies(folder / "trials")
    text, files = write_tables(studies, tmp_path, "hcpg robot trials --report trials")
    assert text == (folder / "trials.md").read_text()
    stored = [folder / file.name for file in files]
    assert all(
        one.read_text() == two.read_text() for one, two in zip(files, stored, strict=True) if two.exists()
    )
    assert all(study.plan["kind"] == "twin" for study in studies)


def test_there_are_trials_on_the_served_twin():
    assert {EVIDENCE / "robot_trials_served", EVIDENCE / "robot_study_served"} <= set(STORED)
