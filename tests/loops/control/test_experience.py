"""What a learner is given of an episode: by hand, and the same from the log as live."""

import numpy as np
import pytest
from point_rig import ROBOT_TASK, constant, episode, rows, uniform
from test_control_episodes import greedy

from hcpg.loops.control.experience import STEP_REWARD, experienced, recovered, rewards


def test_a_success_is_worth_one_and_time_has_a_price():
    assert rewards(np.array([False, False, True])).tolist() == pytest.approx([-0.01, -0.01, 1.0])


def test_an_episode_as_it_was_executed(tmp_path):
    result = episode(tmp_path, horizon=5, propose=constant(1.0, 0, 0, 0))
    made = experienced(7, result, ROBOT_TASK)
    assert (made.number, made.ended, made.actions, made.success) == (7, "time_limit", 5, False)
    # The ramp: a sixth of the step at first, then two sixths, and so on.
    assert made.batch.actions[:, 0].tolist() == pytest.approx([1 / 6, 2 / 6, 3 / 6, 4 / 6, 5 / 6])
    assert made.batch.rewards.tolist() == pytest.approx([STEP_REWARD] * 5)
    assert made.batch.terminated.tolist() == [0.0] * 5  # a time limit bootstraps
    np.testing.assert_array_equal(made.batch.next_observations[:-1], made.batch.observations[1:])


def test_a_success_ends_it(tmp_path):
    made = experienced(0, episode(tmp_path, horizon=60, propose=greedy), ROBOT_TASK)
    assert made.success
    assert made.batch.terminated.tolist() == [0.0] * (made.actions - 1) + [1.0]
    assert float(made.batch.rewards[-1]) == 1.0


def test_the_selectors_weights_have_an_entropy(tmp_path):
    alike = experienced(0, episode(tmp_path, horizon=3, propose=constant(0.1, 0, 0, 0)), ROBOT_TASK)
    assert alike.seen["selector_weight_entropy"] == pytest.approx(np.log(4))  # four equal weights
    assert alike.seen["selector_spread"] == pytest.approx(0.0)
    apart = experienced(0, episode(tmp_path, horizon=3, propose=uniform), ROBOT_TASK)
    assert 0.0 < apart.seen["selector_weight_entropy"] < np.log(4)
    assert apart.seen["selector_spread"] > 0.3


def test_the_log_tells_the_same(tmp_path):
    live = experienced(0, episode(tmp_path, horizon=8), ROBOT_TASK)
    again = recovered(0, 0, rows(tmp_path), ROBOT_TASK)
    assert (again.ended, again.actions) == ("lost", live.actions)
    for one, other in zip(live.batch, again.batch, strict=True):
        np.testing.assert_array_equal(one, other)
    assert again.seen == pytest.approx(live.seen)


def test_an_action_whose_outcome_nobody_saw_is_charged_and_not_learned_from(tmp_path):
    episode(tmp_path, horizon=8)
    until = next(i for i, row in enumerate(rows(tmp_path)) if row["executed"]) + 3
    cut = recovered(0, 0, rows(tmp_path)[:until], ROBOT_TASK)
    assert (cut.actions, len(cut.batch.rewards)) == (3, 2)
