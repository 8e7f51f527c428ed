import numpy as np
import pytest
from scipy.special import softmax
from scipy.stats import zscore

from hcpg.selection.blending import blend, equal_weights, soft_weights, standardise

EPSILON, TEMPERATURE = 1e-6, 0.7


def all_of(scores):
    return np.ones(scores.shape, bool)


def weights_of(scores, **options):
    return soft_weights(standardise(scores, all_of(scores), EPSILON), all_of(scores), TEMPERATURE, **options)


def test_standardised_scores_are_z_scores_with_the_population_deviation(generator):
    scores = generator.normal(size=(6, 4)) * 3.0 + 2.0
    # With ddof = 0, (1, 2, 3, 4) has deviation sqrt(5) / 2 and not sqrt(5 / 3).
    hand = standardise(np.array([1.0, 2.0, 3.0, 4.0]), np.ones(4, bool), EPSILON)
    assert hand == pytest.approx([-3 / 5**0.5, -1 / 5**0.5, 1 / 5**0.5, 3 / 5**0.5])
    assert standardise(scores, all_of(scores), EPSILON) == pytest.approx(zscore(scores, axis=-1, ddof=0))


def test_weights_are_the_softmax_of_the_z_scores(generator):
    scores = generator.normal(size=(6, 4))
    assert weights_of(scores) == pytest.approx(softmax(zscore(scores, axis=-1) / 0.7, axis=-1))


@pytest.mark.parametrize(("count", "limit"), [(2, 1.0), (4, 1.7320508), (8, 2.6457513)])
def test_one_outlier_reaches_the_largest_possible_z_score(count, limit, generator):
    outlier = np.zeros(count)
    outlier[0] = 5.0
    assert standardise(outlier, all_of(outlier), EPSILON).max() == pytest.approx(limit)
    random = generator.standard_cauchy((2000, count))
    assert np.abs(standardise(random, all_of(random), EPSILON)).max() <= limit * (1 + 1e-6)


def test_no_weight_of_four_exceeds_ninety_percent():
    # The extreme is one outlier: z = sqrt(3) and three times -1 / sqrt(3).
    largest = weights_of(np.array([1.0, 0.0, 0.0, 0.0])).max()
    assert largest == pytest.approx(1 / (1 + 3 * np.exp(-(3**0.5 + 3**-0.5) / 0.7)))
    assert largest == pytest.approx(0.900, abs=5e-4)


@pytest.mark.parametrize("gap", [1e-4, 0.1, 1.0, 1e6])
def test_two_candidates_always_weigh_the_same(gap):
    assert weights_of(np.array([gap, 0.0])) == pytest.approx([0.9457, 0.0543], abs=5e-5)


def test_two_tied_candidates_weigh_half_each():
    assert weights_of(np.array([0.3, 0.3])).tolist() == [0.5, 0.5]


def test_one_candidate_weighs_exactly_one():
    assert weights_of(np.array([-0.37])).tolist() == [1.0]


@pytest.mark.parametrize(
    ("count", "largest", "effective", "kept_variance", "gain"),
    [(2, 0.95, 1.1, 0.90, 0.51), (4, 0.69, 1.9, 0.56, 0.81), (8, 0.50, 3.1, 0.35, 1.02)],
)
def test_what_gaussian_scores_turn_into(count, largest, effective, kept_variance, gain, generator):
    scores = generator.normal(size=(60_000, count))
    weights = weights_of(scores)
    squares = np.sum(weights**2, axis=-1)
    assert weights.max(axis=-1).mean() == pytest.approx(largest, abs=0.006)
    assert np.mean(1 / squares) == pytest.approx(effective, abs=0.06)
    assert squares.mean() == pytest.approx(kept_variance, abs=0.006)
    assert np.sum(weights * scores, axis=-1).mean() == pytest.approx(gain, abs=0.012)


def test_a_shift_of_all_scores_changes_nothing(generator):
    scores = generator.normal(size=(50, 4))
    assert weights_of(scores + 7.0) == pytest.approx(weights_of(scores), abs=1e-12)


def test_a_positive_factor_changes_nothing(generator):
    scores = generator.normal(size=(50, 4))
    assert weights_of(scores * 1e3) == pytest.approx(weights_of(scores), abs=1e-12)


def test_a_permutation_of_scores_permutes_weights_and_order_is_kept(generator):
    scores, order = generator.normal(size=(50, 4)), np.array([2, 0, 3, 1])
    weights = weights_of(scores)
    assert weights_of(scores[:, order]) == pytest.approx(weights[:, order], abs=1e-12)
    assert (np.argsort(weights, axis=-1) == np.argsort(scores, axis=-1)).all()


def test_top_k_keeps_the_best_and_their_ratios():
    scores = np.array([0.1, 0.9, 0.4, 0.7])
    weights, full = weights_of(scores, top_k=2), weights_of(scores)
    assert weights[[0, 2]].tolist() == [0.0, 0.0]
    assert weights.sum() == pytest.approx(1.0)
    assert weights[1] / weights[3] == pytest.approx(full[1] / full[3])


@pytest.mark.parametrize("top_k", [None, 4, 9])
def test_top_k_of_all_is_no_truncation(top_k):
    scores = np.array([0.1, 0.9, 0.4, 0.7])
    assert weights_of(scores, top_k=top_k).tolist() == weights_of(scores).tolist()


def test_top_k_of_ties_keeps_exactly_that_many():
    assert weights_of(np.array([0.5, 0.5, 0.5, 0.1]), top_k=2).tolist() == [0.5, 0.5, 0.0, 0.0]


def test_an_unusable_candidate_counts_neither_in_the_moments_nor_in_the_weights():
    scores, usable = np.array([1.0, 99.0, 3.0]), np.array([True, False, True])
    standardised = standardise(scores, usable, EPSILON)
    assert standardised.tolist() == [-1.0, 0.0, 1.0]
    assert soft_weights(standardised, usable, 0.7) == pytest.approx([0.0543, 0.0, 0.9457], abs=5e-5)
    assert equal_weights(usable, scores.dtype).tolist() == [0.5, 0.0, 0.5]


def test_a_blend_is_the_weighted_mean_and_is_clipped():
    proposals = np.array([[0.0, 0.4, 3.0], [1.0, -0.4, 1.0]])
    weights, usable = np.array([0.25, 0.75]), np.ones(2, bool)
    assert blend(weights, proposals, usable, None) == pytest.approx([0.75, -0.2, 1.5])
    assert blend(weights, proposals, usable, (-1.0, 1.0)) == pytest.approx([0.75, -0.2, 1.0])
    assert blend(weights, proposals, usable, (-0.1, 0.5)) == pytest.approx([0.5, -0.1, 0.5])


def test_the_largest_numbers_blend_without_overflow():
    largest = np.finfo(np.float64).max
    proposals = np.array([[largest, -largest], [largest, largest], [largest, 0.0]])
    action = blend(np.array([1.0, 1.0, 1.0]) / 3.0, proposals, np.ones(3, bool), None)
    assert action[0] == largest
    assert abs(action[1]) <= 1e-15 * largest


def test_without_a_usable_candidate_the_action_is_not_a_number():
    weights, usable = np.zeros(2), np.zeros(2, bool)
    assert np.isnan(blend(weights, np.full((2, 3), 0.5), usable, (-1.0, 1.0))).all()
