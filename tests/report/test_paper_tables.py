"""The paper's own rows, to rounding; and the refusals of what no table may mix."""

import csv
import io

import numpy as np
import pytest

from hcpg.report.paper_tables import as_csv, latex, main_table, markdown, method_name, task_name
from hcpg.report.records import RecordError, load_runs
from hcpg.report.statistics import StatisticsError, spread


@pytest.mark.parametrize(
    ("tasks", "mean", "deviation"),
    [
        ([82.5, 100.0, 100.0, 92.3, 98.1, 95.1], 94.67, 6.67),  # Meta-World, SAC-Flow
        ([91.9, 99.9, 99.9, 93.7, 99.1, 98.4], 97.15, 3.46),  # Meta-World, HCPG-Flow
        ([57.5, 96.7, 96.2, 98.3], 87.17, 19.80),  # ManiSkill, SAC-Flow
    ],
)
def test_the_papers_last_rows_are_the_sample_sd_over_task_means(tasks, mean, deviation):
    found = spread(np.array(tasks))
    assert round(found.mean, 2) == pytest.approx(mean, abs=0.011)
    assert round(found.deviation, 2) == pytest.approx(deviation, abs=0.011)


def write(write_run, preset, task, rates):
    """A run per seed with five evaluations of 10 episodes; `rates` are each seed's successes in each."""
    for seed, rate in enumerate(rates):
        path = write_run(preset=preset, seed=seed, bare=[rate] * 5, task=task)
    return path.parents[4]


@pytest.fixture
def root(write_run):
    """QSM's row of drawer-open (33.3 ± 57.7) beside a method that solves both tasks."""
    write(write_run, "qsm", "metaworld/drawer-open", [0, 0, 10])
    write(write_run, "sac_flow", "metaworld/drawer-open", [10, 10, 10])
    write(write_run, "sac_flow", "metaworld/lever-pull", [9, 10, 8])
    return write(write_run, "my_own", "metaworld/lever-pull", [9, 9, 9])


def test_cells_are_means_and_sample_sds_over_seeds(root):
    table = main_table(load_runs([root]))
    assert (table.tasks, table.methods) == (["DrawerOpen", "LeverPull"], ["QSM", "SAC-Flow", "my_own"])
    assert [round(each, 1) for each in table.cells["DrawerOpen", "QSM"]] == [33.3, 57.7]
    assert [round(each, 1) for each in table.across["SAC-Flow"]] == [95.0, 7.1]
    assert table.across.keys() == {"SAC-Flow"}
    assert table.protocol == {
        "budget": "cpu",
        "steps": "500",
        "adapter": "paper",
        "evaluation episodes": "10",
        "seeds": "0 1 2",
    }


def test_the_best_of_several_in_a_row_is_bold_and_an_equal_one_too(root):
    lines = latex(main_table(load_runs([root]))).splitlines()
    assert r"  Task & QSM & SAC-Flow & my\_own \\" in lines
    assert r"  DrawerOpen & 33.3 $\pm$ 57.7 & \textbf{100.0 $\pm$ 0.0} & -- \\" in lines
    assert r"  LeverPull & -- & \textbf{90.0 $\pm$ 10.0} & \textbf{90.0 $\pm$ 0.0} \\" in lines
    assert r"  Across-task mean & -- & 95.0 $\pm$ 7.1 & -- \\" in lines
    text = markdown(main_table(load_runs([root])))
    assert "**100.0 ± 0.0**" in text
    assert "budget cpu, steps 500, adapter paper" in text


def test_one_task_has_no_mean_across_tasks(write_run):
    table = main_table(load_runs([write(write_run, "sac", "point/reach", [1, 2, 3])]))
    assert table.across == {}
    assert [line.split(" |")[0] for line in markdown(table).splitlines()[2:4]] == ["| Reach", ""]
    assert latex(table).count("midrule") == 1


def test_tasks_of_one_name_in_two_suites_keep_their_own(write_run):
    write(write_run, "sac", "point/reach", [1, 1, 1])
    table = main_table(load_runs([write(write_run, "sac", "metaworld/reach", [9, 9, 9])]))
    assert {task: cell.mean for (task, _), cell in table.cells.items()} == {
        "metaworld/reach": pytest.approx(90),
        "point/reach": pytest.approx(10),
    }


def test_the_csv_has_every_number(root):
    rows = list(csv.DictReader(io.StringIO(as_csv(main_table(load_runs([root]))))))
    assert len(rows) == 5
    assert rows[0]["task"] == "DrawerOpen"
    assert float(rows[0]["mean"]) == pytest.approx(100 / 3, abs=1e-3)
    assert float(rows[0]["sd"]) == pytest.approx(57.735, abs=1e-3)
    assert {row["seeds"] for row in rows} == {"0 1 2"}


def test_fewer_than_five_evaluations_are_refused(write_run):
    path = write_run(bare=[1, 2, 3, 4])
    with pytest.raises(StatisticsError, match="needs five evaluations, got 4"):
        main_table(load_runs([path]))


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"bare": [1] * 6}, r"cannot mix steps \(500: a on point/reach; 600: b on point/reach\)"),
        ({"bare": [1] * 5, "episodes": 8}, r"cannot mix evaluation episodes"),
        ({"bare": [1] * 5, "seed": 3}, r"cannot mix seeds \(0: a on point/reach; 3: b on"),
    ],
)
def test_unlike_protocols_are_refused(others, message, write_run):
    path = write_run(preset="a", bare=[1] * 5)
    write_run(preset="b", **others)
    with pytest.raises(RecordError, match=message):
        main_table(load_runs([path.parents[2]]))


def test_names_are_the_papers():
    assert [task_name(f"metaworld/{name}") for name in ("button-press", "peg-insert-side")] == [
        "ButtonPress",
        "PegInsertSide",
    ]
    assert (method_name("hcpg_flow"), method_name("other")) == ("HCPG-Flow", "other")
