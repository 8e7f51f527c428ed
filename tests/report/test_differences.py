"""Intervals of differences: published numbers, limits known by hand, coverage by simulation."""

import numpy as np
import pytest
from scipy import stats

from hcpg.report.differences import (
    Count,
    collapsed,
    episodes_to_settle,
    fisher,
    interquartile_mean,
    newcombe,
    paired_bootstrap,
    probability_of_improvement,
    seeds_to_settle,
)
from hcpg.report.statistics import StatisticsError


@pytest.mark.parametrize(
    ("first", "second", "estimate", "low", "high", "p"),
    [((14, 15), (10, 15), 26.7, -2.8, 52.2, 0.17), ((59, 60), (55, 60), 6.7, -1.9, 16.5, 0.21)],
)
def test_the_papers_real_robot_counts_do_not_leave_out_zero(first, second, estimate, low, high, p):
    """Rugby-ball grasping, and all four tasks together."""
    found = newcombe(Count(*first), Count(*second))
    rounded = [round(100 * value, 1) for value in (found.estimate, *found.interval)]
    assert rounded == [estimate, low, high]
    assert not found.settled
    assert round(fisher(Count(*first), Count(*second)), 2) == p


def test_a_clear_difference_is_settled_in_either_direction():
    many, few = Count(95, 100), Count(40, 100)
    assert newcombe(many, few).settled
    assert newcombe(few, many).settled
    assert newcombe(few, many).interval == pytest.approx(
        [-each for each in newcombe(many, few).interval[::-1]]
    )


def test_impossible_counts_are_refused():
    with pytest.raises(StatisticsError, match="successes=3, episodes=2"):
        newcombe(Count(3, 2), Count(1, 2))
    with pytest.raises(StatisticsError, match="episodes=0"):
        newcombe(Count(1, 2), Count(0, 0))


def test_pairing_takes_out_what_start_states_have_in_common():
    """Both solve the same half of the starts, and the first four more: paired, that is clear."""
    easy = np.arange(40) % 2 == 0
    first, second = easy.copy(), easy
    first[[1, 3, 5, 7, 9, 11]] = True
    paired = paired_bootstrap(first[None], second[None])
    assert paired.estimate == pytest.approx(6 / 40)
    assert paired.settled
    assert not newcombe(Count(int(first.sum()), 40), Count(int(second.sum()), 40)).settled


def test_seeds_that_differ_widen_the_paired_interval():
    one = paired_bootstrap(np.ones((1, 20), bool), np.zeros((1, 20), bool))
    assert one.interval == (1.0, 1.0)
    split = np.repeat([[True], [False]], 20, axis=1)
    assert paired_bootstrap(split, ~split).interval == (-1.0, 1.0)
    with pytest.raises(StatisticsError, match=r"\(1, 3\) and \(1, 4\)"):
        paired_bootstrap(np.ones((1, 3), bool), np.ones((1, 4), bool))


def test_the_paired_bounds_are_those_that_resampling_tends_to():
    """Two seeds, two starts. One seed gains nothing; two draws of the other's give 0, 1, 2 (1/4, 1/2, 1/4).

    So a drawn seed gives 0, 1, 2 with chances 5/8, 1/4, 1/8; two of them 4 with 1/64, 3 or more with 5/64,
    2 or more with 19/64.
    """
    first, second = np.array([[True, False], [True, False]]), np.array([[True, False], [False, False]])
    for confidence, high in ((0.95, 0.75), (0.96, 0.75), (0.98, 1.0), (0.8, 0.5)):
        assert paired_bootstrap(first, second, confidence).interval == (0.0, high)
        assert paired_bootstrap(second, first, confidence).interval == (-high, 0.0)


def test_the_paired_bounds_agree_with_scipys_resampling():
    """One seed: SciPy resamples the same gains."""
    random = np.random.default_rng(3)
    first, second = random.random((1, 400)) < 0.7, random.random((1, 400)) < 0.5
    gains = first[0].astype(float) - second[0]
    theirs = stats.bootstrap((gains,), np.mean, method="percentile", n_resamples=20_000, rng=0)
    ours = paired_bootstrap(first, second).interval
    assert ours == pytest.approx(tuple(theirs.confidence_interval), abs=0.005)


def test_the_paired_interval_covers_a_known_difference_about_as_often_as_it_says():
    """One seed, 40 starts: success probabilities differ by 0.2 on average."""
    random, hits = np.random.default_rng(0), 0
    for _ in range(60):
        level = random.uniform(size=(1, 40))
        first, second = level < 0.7, level < 0.5
        low, high = paired_bootstrap(first, second).interval
        hits += low <= 0.2 <= high
    assert stats.binomtest(hits, 60, 0.95).pvalue > 0.001


def test_the_interquartile_mean_leaves_out_the_outer_quarters():
    scores = np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 100.0]])
    found = interquartile_mean(scores)
    assert found.estimate == pytest.approx(3.5)
    assert found.interval.low < 3.5 < found.interval.high <= 100
    same = interquartile_mean(np.full((3, 3), 0.4))
    assert same.interval == pytest.approx((0.4, 0.4))


def test_the_probability_of_improvement_is_mann_whitneys_share():
    first, second = np.array([[3.0, 1.0, 2.0]]), np.array([[0.0, 2.0]])
    expected = stats.mannwhitneyu(first[0], second[0]).statistic / 6
    assert probability_of_improvement(first, second).estimate == pytest.approx(expected)
    even = probability_of_improvement(np.array([[0.0, 1.0]] * 4), np.array([[0.0, 1.0]] * 4))
    assert even.estimate == 0.5
    # Four tasks, each a difference of two Bernoulli means of two draws: SD sqrt(1/4 / 2 * 2 / 4) / 2 = 0.125.
    assert even.interval == pytest.approx((0.5 - 1.96 * 0.125, 0.5 + 1.96 * 0.125), abs=0.03)
    better = probability_of_improvement(first + 10, second)
    assert (better.estimate, *better.interval) == (1.0, 1.0, 1.0)
    with pytest.raises(StatisticsError, match="by task"):
        probability_of_improvement(first, np.zeros((2, 2)))


def test_a_seed_has_collapsed_that_fell_below_half_after_four_fifths():
    rates = np.array([[0.9, 0.4, 0.9], [0.4, 0.9, 0.6], [0.7, 0.1, 0.9], [0.0, 0.8, 0.49]])
    np.testing.assert_array_equal(collapsed(rates), [True, False, False, True])


def test_telling_92_from_97_percent_takes_326_episodes_per_method():
    assert episodes_to_settle(0.97, 0.92) == episodes_to_settle(0.92, 0.97) == 326
    assert episodes_to_settle(0.5, 0.5) is None
    with pytest.raises(StatisticsError, match=r"got 1\.2 and 0\.5"):
        episodes_to_settle(1.2, 0.5)


def test_seeds_apart_by_one_deviation_need_17_of_each():
    """The textbook's sample size of a two-sided t test at 5 % with 80 % power."""
    first = np.array([0.0, 0.5, 1.0])  # deviation 0.5
    assert seeds_to_settle(first, first + 0.5) == 17
    assert seeds_to_settle(first, first) is None
    assert seeds_to_settle(first[:1], first) is None
    assert seeds_to_settle(np.ones(3), np.zeros(3)) is None
