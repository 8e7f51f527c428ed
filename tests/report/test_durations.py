"""What a run costs, though it was suspended on the way."""

import math

import pytest

from hcpg.report.durations import undisturbed_s

EVALUATED = [300, 600, 900]


def rows_of(suspended_after=None, pause_s=3600.0):
    """A row every 100 steps: 2 s of training each, evaluations of 10 s; 4 s of compiling before the first."""
    rows, wall = [], 4.0
    for step in range(100, 1000, 100):
        wall += 2.0
        rows.append({"step": step, "wall_s": wall})
        wall += 10.0 * (step in EVALUATED) + pause_s * (step == suspended_after)
    return rows


def test_steps_and_evaluations_both_count_and_the_compiler_does_not():
    assert undisturbed_s(rows_of(), EVALUATED) == pytest.approx(9 * 2.0 + 3 * 10.0)
    assert undisturbed_s(rows_of(), []) == pytest.approx(9 * 2.0)


@pytest.mark.parametrize("step", [200, 300])
def test_a_suspension_is_no_cost_wherever_it_falls(step):
    evaluated = [*EVALUATED, 800]
    once = [row | {"wall_s": row["wall_s"] + 10.0 * (row["step"] > 800)} for row in rows_of()]
    suspended = [row | {"wall_s": row["wall_s"] + 3600.0 * (row["step"] > step)} for row in once]
    assert undisturbed_s(suspended, evaluated) == pytest.approx(9 * 2.0 + 4 * 10.0)


def test_too_few_rows_say_nothing():
    assert math.isnan(undisturbed_s(rows_of()[:2], []))
