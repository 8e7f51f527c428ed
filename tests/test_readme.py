"""The README's results are what the commands beside them print from the stored runs."""

import re
from pathlib import Path

import pytest

from hcpg.report.comparison import compared, outcomes
from hcpg.report.paper_tables import main_table, markdown
from hcpg.report.records import load_runs

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text()
REPORTS = re.findall(r"^hcpg report (docs/evidence.*) --out build/\w+$", TEXT, re.MULTILINE)


def test_there_are_two_tables():
    assert len(REPORTS) == TEXT.count("Last-five success, percent, mean and sample SD") == 2


@pytest.mark.parametrize("folders", REPORTS)
def test_a_table_follows_from_the_stored_runs(folders):
    table = markdown(main_table(load_runs(ROOT / folder for folder in folders.split())))
    command = f"hcpg report {folders} "
    assert TEXT.index(command) < TEXT.index(table) < TEXT.index(command) + len(command) + 60
    assert "budget cpu" in table


def test_the_comparison_says_what_is_quoted():
    first, second = re.search(r"`hcpg compare (docs\S*) (docs\S*)`", TEXT).groups()
    told = compared(outcomes(ROOT / first), outcomes(ROOT / second)).splitlines()[-1]
    assert f'says: "{told}"' in TEXT
