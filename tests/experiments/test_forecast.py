"""The time that is left, by hand."""

import pytest
from tiny_cells import cell

from hcpg.experiments.forecast import hours_left
from hcpg.experiments.ledger import Entry

STEPS = 3600
LONG = {"steps": STEPS, "warmup_steps": 100}


def entry(seed, state="left", step=0, seconds=0.0, preset="sac", task="point/reach"):
    plain = cell(seed, **LONG)
    settings = plain.settings
    changed = type(settings)(**{**vars(settings), "preset": preset, "task": task})
    return Entry(plain._replace(settings=changed), state, None, step, seconds)


def done(seed, seconds, **names):
    return entry(seed, "finished", STEPS, seconds, **names)


def test_nothing_is_known_before_a_run_has_left_its_warmup():
    assert hours_left([entry(0), entry(1, "running", 100, 5.0)], 2) is None
    assert hours_left([entry(0), entry(1, "running", 101, 101.0)], 2) is not None


def test_what_runs_took_is_what_they_will_take_side_by_side():
    seen = [done(0, 1800.0), done(1, 5400.0)]
    left = [entry(2), entry(3), entry(4)]
    assert hours_left([*seen, *left], 3) == pytest.approx(1.0)
    assert hours_left([*seen, *left], 2) == pytest.approx(2.0)
    assert hours_left([*seen, *left], 1) == pytest.approx(3.0)
    assert hours_left(seen, 2) == 0.0


def test_a_run_that_is_half_way_needs_half_the_time_and_a_diverged_one_none():
    seen = [entry(0, "running", STEPS // 2, 3600.0), entry(1, "diverged", 200, 400.0)]
    assert hours_left(seen, 2) == pytest.approx(1.0)


def test_the_own_task_and_preset_count_before_the_preset_and_that_before_all():
    seen = [done(0, 3600.0), done(0, 10_800.0, task="point/carry"), done(0, 36_000.0, preset="qsm")]
    assert hours_left([*seen, entry(1)], 1) == pytest.approx(1.0)
    assert hours_left([*seen, entry(1, task="point/none")], 1) == pytest.approx(2.0)
    assert hours_left([*seen, entry(1, preset="flowrl")], 1) == pytest.approx((1 + 3 + 10) / 3)
