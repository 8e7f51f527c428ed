"""The page's numbers against those of the runs in conftest, worked out by hand."""

import pytest

from hcpg.report.page.results import results, task_means
from hcpg.report.records import load_runs
from hcpg.report.statistics import StatisticsError


@pytest.fixture(scope="module")
def found(groups):
    return {(each["task"], each["preset"]): each for each in results(groups)}


def test_what_the_paper_reads_from_a_curve(found):
    own = found["metaworld/drawer-open", "hcpg_flow"]["own"]
    assert own["last_five"] == {"mean": 60.0, "deviation": 0.0, "values": [60.0, 60.0]}
    assert own["auc"]["mean"] == 60.0
    assert (own["final"]["mean"], own["final"]["successes"], own["final"]["episodes"]) == (100.0, 20, 20)
    assert [round(own["final"][edge], 1) for edge in ("low", "high")] == [83.9, 100.0]
    assert own["reached"] == [400, 400]
    assert own["collapsed"] == 0


def test_curves_are_percent_by_step_with_both_bands(found):
    curve = found["metaworld/drawer-open", "sac_flow"]["own"]
    assert curve["steps"] == [100, 200, 300, 400, 500]
    assert (curve["mean"], curve["seeds"]) == ([50.0] * 5, [[0.0] * 5, [100.0] * 5])
    assert curve["deviation"][0] == pytest.approx(70.7107, abs=1e-4)
    assert [round(curve[edge][0], 1) for edge in ("low", "high")] == [29.9, 70.1]


def test_a_selector_has_its_bare_actor_beside_it_and_a_preset_without_one_has_not(found):
    guided, alone = (found["metaworld/drawer-open", preset] for preset in ("hcpg_flow", "sac_flow"))
    assert (guided["selector"], guided["bare"]["mean"]) == ("hcpg", [0.0, 0.0, 10.0, 20.0, 50.0])
    assert (alone["selector"], alone["bare"]) == (None, None)
    assert guided["hours"] == pytest.approx(180.5 / 3600, abs=1e-6)


def test_the_last_row_is_over_tasks_for_presets_that_have_them_all(found):
    means = task_means(list(found.values()), ["sac_flow", "hcpg_flow"])
    assert means["own"]["last_five"].keys() == {"hcpg_flow"}
    assert means["own"]["last_five"]["hcpg_flow"]["mean"] == 75.0
    assert means["own"]["last_five"]["hcpg_flow"]["deviation"] == pytest.approx(21.2132, abs=1e-4)
    assert means["bare"]["final"]["hcpg_flow"]["values"] == [50.0, 30.0]


def test_numbers_come_out_as_in_the_other_tables():
    """Means of 99 1/3, 3 1/3 and 100: their mean is 67.6, not what rounding twice makes of it."""
    entries = []
    for task, mean in enumerate((99.333333, 3.333333, 100.0)):
        own = {metric: {"mean": mean} for metric in ("last_five", "auc", "final")}
        entries.append({"task": str(task), "preset": "p", "bare": None, "own": own})
    assert f"{task_means(entries, ['p'])['own']['last_five']['p']['mean']:.1f}" == "67.6"


def test_fewer_than_five_evaluations_are_refused(write_run, tmp_path):
    write_run(bare=[1, 2, 3, 4])
    with pytest.raises(StatisticsError, match="needs five evaluations, got 4"):
        results(load_runs([tmp_path]))
