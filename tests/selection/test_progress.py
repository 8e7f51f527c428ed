import numpy as np
import pytest

from hcpg.selection.progress import contact_phase, directional_progress, score

EPSILON = 1e-6
NOWHERE = np.zeros(3)


def test_progress_is_the_part_of_the_move_along_the_target():
    moves = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.4, 0.5], [0.0, 0.0, 1.0]])
    # (3, 4, 0) points along (.6, .8, 0).
    assert directional_progress(moves, np.array([3.0, 4.0, 0.0]), EPSILON) == pytest.approx(
        [0.6, 0.8, 0.5, 0.0]
    )


def test_progress_is_the_first_order_reduction_of_distance(generator):
    """Equation (6): what is left over shrinks with the square of the step."""
    place, goal, move = generator.normal(size=(3, 3))
    predicted = directional_progress(move[None], goal - place, EPSILON)[0]

    def error(step):
        reduction = np.linalg.norm(goal - place) - np.linalg.norm(goal - (place + step * move))
        return abs(reduction - step * predicted)

    assert error(1e-3) < 1e-5
    assert error(1e-3) / error(1e-4) == pytest.approx(100.0, rel=0.01)


@pytest.mark.parametrize("distance", [0.0, 1e-9, 1e-7])
def test_a_vanishing_target_gives_vanishing_progress(distance):
    target = np.array([distance, 0.0, 0.0])
    # |D| = |u| * distance / epsilon below epsilon.
    assert directional_progress(np.array([[2.0, 0.0, 0.0]]), target, EPSILON) == pytest.approx(
        [2e6 * distance]
    )


@pytest.mark.parametrize("scale", [1e-5, 1e-3, 10.0, 1e300])
def test_the_length_of_the_target_does_not_matter(scale, generator):
    moves, target = generator.normal(size=(4, 3)), np.array([0.6, 0.0, 0.8])
    expected = moves @ target
    assert directional_progress(moves, target * scale, EPSILON) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("approach", "phase"),
    [
        ([0.0799, 0.0, 0.0], 1.0),
        ([0.08, 0.0, 0.0], 0.0),
        ([0.0801, 0.0, 0.0], 0.0),
        ([0.06, 0.06, 0.0], 0.0),
        ([0.05, 0.05, 0.0], 1.0),
        ([0.0, 0.0, 0.0], 1.0),
        ([1e308, -1e308, 1e308], 0.0),
    ],
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_without_a_flag_contact_begins_strictly_inside_eight_centimetres(approach, phase, dtype):
    largest = np.finfo(dtype).max
    assert contact_phase(np.clip(approach, -largest, largest).astype(dtype), None, 0.08) == phase


def test_the_gate_is_per_environment():
    approach = np.array([[0.01, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.079, 0.0]])
    assert contact_phase(approach, None, 0.08).tolist() == [1.0, 0.0, 1.0]


@pytest.mark.parametrize(("flag", "phase"), [(0.0, 0.0), (1.0, 1.0), (0.25, 0.25), (-3.0, 0.0), (7.0, 1.0)])
@pytest.mark.parametrize("distance", [0.0, 1.0])
def test_the_flag_goes_before_the_distance_and_is_clipped(flag, phase, distance):
    assert contact_phase(np.array([distance, 0.0, 0.0]), np.array(flag), 0.08) == phase


@pytest.mark.parametrize(("phase", "expected"), [(0.0, 0.95), (1.0, -0.05), (0.25, 0.70)])
def test_the_phase_mixes_approach_and_task_progress(phase, expected):
    # A unit move along the approach, across the task: (1 - c) * 1 + c * 0 - .05 * 1.
    move = np.array([[1.0, 0.0, 0.0]])
    approach, task = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.2, 0.0])
    assert score(move, approach, task, np.array(phase), 0.05, EPSILON) == pytest.approx([expected])


@pytest.mark.parametrize(("cosine", "winner"), [(0.5, 1), (0.06, 1), (0.04, 0), (-0.5, 0)])
def test_of_two_moves_one_way_the_large_one_wins_above_a_cosine_of_the_penalty(cosine, winner):
    way = np.array([cosine, np.sqrt(1 - cosine**2), 0.0])
    scores = score(
        np.stack([0.2 * way, 0.9 * way]), np.array([1.0, 0.0, 0.0]), NOWHERE, np.array(0.0), 0.05, EPSILON
    )
    # |u| * (cos - .05)
    assert scores == pytest.approx([0.2 * (cosine - 0.05), 0.9 * (cosine - 0.05)])
    assert np.argmax(scores) == winner


def test_without_any_target_only_the_price_of_moving_ranks(generator):
    moves = generator.normal(size=(5, 3))
    scores = score(moves, NOWHERE, NOWHERE, np.array(0.0), 0.05, EPSILON)
    assert scores == pytest.approx(-0.05 * np.linalg.norm(moves, axis=-1))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("penalty", [0.05, 1e6])
def test_the_largest_numbers_score_finite(dtype, penalty):
    largest = np.finfo(dtype).max
    moves = np.full((4, 3), largest) * np.array([[1.0], [-1.0], [0.5], [0.0]], dtype)
    scores = score(moves, np.full(3, largest), np.full(3, -largest), np.array(0.5, dtype), penalty, EPSILON)
    assert scores.dtype == dtype
    assert np.isfinite(scores).all()
