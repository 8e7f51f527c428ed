"""The table of trials against the paper's own numbers and formulas worked out by hand."""

import math

import pytest
from trial_studies import paper_studies, write_study

from hcpg.report.records import RecordError
from hcpg.report.trial_records import find_studies
from hcpg.report.trial_table import OVERALL, trial_table


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return trial_table(find_studies(paper_studies(tmp_path_factory.mktemp("trials"))))


def bounds(successes, trials):
    """Wilson's interval, by its formula."""
    z, rate = 1.959963984540054, successes / trials
    middle = (rate + z**2 / (2 * trials)) / (1 + z**2 / trials)
    half = z / (1 + z**2 / trials) * math.sqrt(rate * (1 - rate) / trials + z**2 / (4 * trials**2))
    return middle - half, middle + half


def test_each_cell_is_counted_from_the_ledger(table):
    rugby = table.cells["franka/rugby-grasp", "hcpg_flow"]
    assert (rugby.tally, rugby.steps, rugby.deviation) == ((14, 15), 43.0, 0.0)
    assert tuple(rugby.rate) == pytest.approx(bounds(14, 15))
    # One failure counts 200: (14 * 43 + 200) / 15.
    assert rugby.capped == pytest.approx(802 / 15)
    peg = table.cells["franka/peg-insertion", "sac_flow"]
    assert (peg.tally, peg.steps, peg.capped) == ((15, 15), 30.0, 30.0)


def test_overall_pools_the_trials_and_averages_the_tasks_steps(table):
    ours, theirs = table.cells[OVERALL, "hcpg_flow"], table.cells[OVERALL, "sac_flow"]
    assert (ours.tally, theirs.tally) == ((29, 30), (25, 30))
    assert (ours.steps, theirs.steps) == (33.5, 45.0)
    assert tuple(ours.rate) == pytest.approx(bounds(29, 30))


def test_the_paper_s_own_difference_is_not_settled(table):
    [rugby] = [each for each in table.contrasts if each.task == "franka/rugby-grasp"]
    assert (rugby.first, rugby.second) == ("sac_flow", "hcpg_flow")
    # 14/15 against 10/15: hypergeometric probabilities with 24 successes among 30, those not above 10's own.
    ways = {k: math.comb(15, k) * math.comb(15, 24 - k) for k in range(9, 16)}
    p = sum(each for each in ways.values() if each <= ways[10] + 1e-9) / math.comb(30, 24)
    assert rugby.p == pytest.approx(p)
    assert rugby.p == pytest.approx(0.169, abs=0.0005)
    (low_1, high_1), (low_2, high_2) = bounds(10, 15), bounds(14, 15)
    difference = 10 / 15 - 14 / 15
    assert rugby.difference.estimate == pytest.approx(difference)
    assert rugby.difference.interval.low == pytest.approx(
        difference - math.hypot(10 / 15 - low_1, high_2 - 14 / 15), abs=1e-6
    )
    assert rugby.difference.interval.high == pytest.approx(
        difference + math.hypot(high_1 - 10 / 15, 14 / 15 - low_2), abs=1e-6
    )
    assert not rugby.difference.settled


def test_a_policy_without_success_has_no_steps_but_its_cap(tmp_path):
    write_study(tmp_path / "a", "point/reach", {"initial": [-1, -1]})
    cell = trial_table(find_studies(tmp_path)).cells["point/reach", "initial"]
    assert math.isnan(cell.steps)
    assert cell.capped == 60.0


def test_what_does_not_count_is_left_out(tmp_path):
    extra = [{"row": "judged", "trial": 1, "attempt": 1, "operator": None, "invalid": "the operator: caught"}]
    write_study(tmp_path / "a", "point/reach", {"ours": [5, -1, 7]}, extra=extra)
    cell = trial_table(find_studies(tmp_path)).cells["point/reach", "ours"]
    assert (cell.tally, cell.steps) == ((1, 2), 7.0)


def test_a_twin_and_an_arm_are_never_in_one_table(tmp_path):
    write_study(tmp_path / "a", "point/reach", {"ours": [5]})
    write_study(tmp_path / "b", "point/carry", {"ours": [5]}, kind="real")
    with pytest.raises(RecordError, match="different arms"):
        trial_table(find_studies(tmp_path))


def test_no_trials_and_one_task_twice_are_said(tmp_path):
    with pytest.raises(RecordError, match="there are no trials"):
        trial_table(find_studies(tmp_path))
    for name in "ab":
        write_study(tmp_path / name, "point/reach", {"ours": [5]})
    with pytest.raises(RecordError, match="point/reach has trials in"):
        find_studies(tmp_path)
