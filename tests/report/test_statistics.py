"""Summaries against numbers worked out by hand, and against the paper's own tables."""

import math

import numpy as np
import pytest

from hcpg.report.statistics import StatisticsError, auc, final, last_five, spread, steps_to, wilson

# Paper, tables I and II: last-five success of each task.
METAWORLD = {
    "SAC": ([82.0, 55.1, 99.9, 83.9, 79.7, 55.9], 76.1, 17.5),
    "FlowRL": ([78.0, 65.3, 99.5, 83.1, 64.8, 93.2], 80.6, 14.2),
    "QSM": ([94.5, 33.3, 100.0, 51.7, 99.9, 64.9], 74.1, 28.3),
    "SAC-Flow": ([82.5, 100.0, 100.0, 92.3, 98.1, 95.1], 94.7, 6.7),
    "HCPG-Flow": ([91.9, 99.9, 99.9, 93.7, 99.1, 98.4], 97.1, 3.5),
}
MANISKILL = {
    "FlowRL": ([1.6, 99.9, 96.8, 99.9], 74.5, 48.6),
    "SAC-Flow": ([57.5, 96.7, 96.2, 98.3], 87.2, 19.8),
    "HCPG-Flow": ([91.7, 98.8, 96.7, 99.6], 96.7, 3.6),
}


@pytest.mark.parametrize(("tasks", "mean", "deviation"), [*METAWORLD.values(), *MANISKILL.values()], ids=str)
def test_the_papers_across_task_rows(tasks, mean, deviation):
    found = spread(np.array(tasks))
    # The task means are themselves printed to 0.1, so the row can be off by that rounding.
    assert found.mean == pytest.approx(mean, abs=0.1)
    assert found.deviation == pytest.approx(deviation, abs=0.1)


def test_the_papers_qsm_drawer_open_row_is_the_sample_deviation():
    found = spread(100 * last_five(np.array([[0.0] * 5, [0.0] * 5, [1.0] * 5])))
    assert (round(found.mean, 1), round(found.deviation, 1)) == (33.3, 57.7)


def test_one_seed_has_no_deviation():
    found = spread(np.array([0.4]))
    assert found.mean == 0.4
    assert math.isnan(found.deviation)


def test_last_five_ignores_what_came_before():
    rates = np.array([[0.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0]])
    np.testing.assert_allclose(last_five(rates), [0.3, 0.8])
    np.testing.assert_array_equal(final(rates), [0.5, 0.0])
    with pytest.raises(StatisticsError, match="five evaluations, got 4"):
        last_five(rates[:, :4])
    with pytest.raises(StatisticsError, match="no evaluation yet"):
        final(rates[:, :0])


def test_area_is_trapezoids_over_the_scaled_steps():
    # Trapezoids of widths 1/4 and 3/4: (0 + 1)/2 * 1/4 + (1 + 0.5)/2 * 3/4 = 0.6875.
    np.testing.assert_allclose(auc(np.array([100, 200, 500]), np.array([[0.0, 1.0, 0.5]])), [68.75])
    np.testing.assert_allclose(auc(np.array([10, 20]), np.array([[0.3, 0.3], [0.0, 1.0]])), [30.0, 50.0])
    with pytest.raises(StatisticsError, match="two evaluations, got 1"):
        auc(np.array([10]), np.array([[0.5]]))


def test_steps_to_a_level_is_the_first_evaluation_that_has_it():
    steps = np.array([10, 20, 30, 40])
    assert steps_to(steps, np.array([0.0, 0.8, 0.5, 1.0]), 0.8) == 20
    assert steps_to(steps, np.array([0.0, 0.7, 0.5, 0.79]), 0.8) is None


def test_wilson_interval_by_hand():
    # z = 1.959964, z^2 = 3.841459. Of 0 in 10: [0, z^2 / (n + z^2)] = [0, 0.277533].
    assert wilson(0, 10) == pytest.approx((0.0, 3.841459 / 13.841459), abs=1e-6)
    # Of 8 in 10: centre (0.8 + z^2/20) / (1 + z^2/10), half width z sqrt(0.016 + z^2/400) / (1 + z^2/10).
    centre = (0.8 + 3.841459 / 20) / 1.3841459
    half = 1.959964 * math.sqrt(0.016 + 3.841459 / 400) / 1.3841459
    assert wilson(8, 10) == pytest.approx((centre - half, centre + half), abs=1e-6)
    with pytest.raises(StatisticsError, match="11 successes of 10 episodes"):
        wilson(11, 10)
    with pytest.raises(StatisticsError, match="0 successes of 0 episodes"):
        wilson(0, 0)
