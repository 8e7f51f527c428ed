"""The table's cells, each worked out by hand from the successes written into sample runs."""

import pytest

from hcpg.report.records import load_runs
from hcpg.report.tables import markdown


def cells(text):
    lines = [line.strip("| ").split("|") for line in text.splitlines() if line.startswith("|")]
    return {line[0].strip(): [cell.strip() for cell in line[1:]] for line in lines[2:]}


@pytest.fixture
def groups(tmp_path, write_run):
    write_run(preset="hcpg_flow", seed=0, success=[0, 2, 8, 10, 10, 10], bare=[0, 0, 0, 0, 0, 9])
    write_run(preset="hcpg_flow", seed=1, success=[0, 0, 0, 5, 9, 6], bare=[0, 0, 0, 0, 0, 3])
    write_run(preset="sac_flow", seed=0, bare=[0, 0, 1])
    return load_runs([tmp_path])


def test_each_cell(groups):
    table = cells(markdown(groups))
    assert table["seeds"] == ["0 1", "0"]
    assert table["selector"] == ["hcpg", "none"]
    assert table["adapter"] == ["paper", "paper"]
    assert table["state"] == ["finished", "finished"]
    assert table["evaluated at step"] == ["600", "300"]
    # 16 of 20 and 1 of 10; Wilson's bounds from an independent table.
    assert table["last evaluation"] == ["80.0 [58.4, 91.9]", "10.0 [1.8, 40.4]"]
    assert table["- by seed"] == ["100 60", "10"]
    assert table["- bare actor"] == ["60.0 [38.7, 78.1]", "10.0 [1.8, 40.4]"]
    assert table["- bare, by seed"] == ["90 30", "10"]
    # Seed 0: (.2 + .8 + 1 + 1 + 1) / 5 = 80 %; seed 1: (0 + 0 + .5 + .9 + .6) / 5 = 40 %; SD = 40 / sqrt(2).
    assert table["last five"] == ["60.0 ± 28.3", "-"]
    # Seed 0: (.1 + .5 + .9 + 1 + 1) / 5 = 70; seed 1: (0 + 0 + .25 + .7 + .75) / 5 = 34; SD = 36 / sqrt(2).
    # The other: (0 + .05) / 2 = 2.5.
    assert table["AUC"] == ["52.0 ± 25.5", "2.5"]
    assert table["steps to 80 %"] == ["300 500", "-"]
    assert table["fell below 50 % after 80 %"] == ["0 of 2", "0 of 1"]
    assert table["steps/s per seed"] == ["300", "300"]
    assert table["wall time, s"] == ["180", "180"]


def test_columns_line_up_as_plain_text(groups):
    lines = [line for line in markdown(groups).splitlines() if line.startswith("|")]
    assert len({len(line) for line in lines}) == 1
    assert max(len(line) for line in lines) <= 80


def test_a_task_has_its_own_table(groups, tmp_path, write_run):
    write_run(preset="hcpg_flow", seed=0, success=[3], bare=[3], task="point/carry")
    lines = markdown(load_runs([tmp_path])).splitlines()
    assert [line for line in lines if line.startswith("#")] == [
        "### point/carry",
        "### point/reach",
    ]


def test_a_seed_that_lost_what_it_had_reached_is_counted(write_run):
    write_run(preset="a", seed=0, bare=[9, 4, 9])
    path = write_run(preset="a", seed=1, bare=[9, 5, 9])
    text = markdown(load_runs([path.parents[1]]))
    assert "| fell below 50 % after 80 % | 1 of 2" in text
