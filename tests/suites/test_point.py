"""The point gripper: its dynamics by hand, its optimum, and that random proposals cannot solve it."""

from dataclasses import replace

import numpy as np
import pytest

from hcpg import registry
from hcpg.selection import select
from hcpg.suites.point import SUITE, optimal_steps, steps_between

CARRY, REACH = registry.task("point/carry"), registry.task("point/reach")


def observe(tool=(0.0, 0.0, 0.2), object=(0.1, 0.0, 0.02), goal=(0.0, 0.1, 0.2), opening=1.0, held=0.0):
    return np.array([*tool, opening, *object, *goal, held], np.float32)


def follow_optimum(observation, task):
    """The scripted optimal action: straight on along each axis, fingers closing just in time."""
    tool, opening, held = observation[0:3], observation[3], observation[10]
    if task.env_id == "reach":
        target, firm = observation[4:7] - tool, False
    elif held:
        target, firm = observation[7:10] - observation[4:7], True
    else:
        target = observation[4:7] - tool
        firm = steps_between(tool, observation[4:7]) <= round((opening - 0.125) / 0.125)
    return np.array([*np.clip(target / 0.02, -1, 1), 1.0 if firm else 0.0])


def steps_to_success(environment, task, start):
    observation = environment.reset(start)
    for step in range(1, task.horizon + 1):
        observation, _, _, success = environment.step(follow_optimum(observation, task))
        if success:
            return step
    return None


def test_one_unit_moves_two_centimetres_and_walls_hold():
    environment = SUITE.make(CARRY, 0)
    before = environment.reset(0)
    after = environment.step(np.array([1.0, -0.5, 3.0, 0.0])).observation
    np.testing.assert_allclose(after[0:3] - before[0:3], [0.02, -0.01, 0.02], atol=1e-7)
    for _ in range(40):
        after = environment.step(np.array([1.0, -1.0, 1.0, 0.0])).observation
    np.testing.assert_allclose(after[0:3], [0.25, -0.25, 0.35], atol=1e-7)


def test_fingers_close_in_seven_full_commands_and_spring_back():
    environment = SUITE.make(CARRY, 0)
    environment.reset(0)
    close, slack = np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.0, 0.5])
    openings = [environment.step(close).observation[3] for _ in range(9)]
    assert openings == [0.875, 0.75, 0.625, 0.5, 0.375, 0.25, 0.125, 0.0, 0.0]
    assert environment.step(slack).observation[3] == 0.0
    # No command lets the spring open by 0.125, a full opening command by 0.375.
    assert environment.step(np.zeros(4)).observation[3] == 0.125
    assert environment.step(-close).observation[3] == 0.5


def bring_to_hold(environment, task=CARRY):
    observation = environment.reset(2)
    while not observation[10]:
        observation = environment.step(follow_optimum(observation, task)).observation
    return observation


def test_a_held_object_moves_with_the_tool_and_falls_when_let_go():
    environment = SUITE.make(CARRY, 0)
    held = bring_to_hold(environment)
    lifted = environment.step(np.array([0.0, 0.0, 1.0, 1.0])).observation
    for _ in range(4):
        lifted = environment.step(np.array([0.0, 0.0, 1.0, 1.0])).observation
    np.testing.assert_allclose(lifted[4:7] - held[4:7], [0.0, 0.0, 0.1], atol=1e-6)
    # The fingers were fully closed: 0, 0.125 still hold, 0.25 lets go and the object falls 0.04 m a step.
    slack = np.zeros(4)
    heights = [environment.step(slack).observation[[6, 10]].tolist() for _ in range(5)]
    np.testing.assert_allclose(heights, [[0.12, 1], [0.08, 0], [0.04, 0], [0.02, 0], [0.02, 0]], atol=1e-6)


def test_fingers_that_are_already_closed_grasp_nothing():
    environment = SUITE.make(CARRY, 0)
    observation = environment.reset(2)
    for _ in range(30):
        action = follow_optimum(observation, REACH)
        action[3] = 1.0
        observation = environment.step(action).observation
    np.testing.assert_allclose(observation[0:3], observation[4:7], atol=1e-6)
    assert observation[[3, 10]].tolist() == [0.0, 0.0]


def test_rewards_by_hand():
    environment = SUITE.make(CARRY, 0)
    observation = environment.reset(0)
    reach = float(np.linalg.norm(observation[0:3] - observation[4:7]))
    still = environment.step(np.zeros(4))
    assert still.reward == pytest.approx(0.2 * (1 - np.tanh(10 * reach)), abs=1e-6)
    assert SUITE.make(REACH, 0).step(np.zeros(4)).reward == pytest.approx(1 - np.tanh(10 * reach), abs=1e-6)
    held = bring_to_hold(environment)
    still = environment.step(np.array([0.0, 0.0, 0.0, 1.0]))
    reach = float(np.linalg.norm(held[0:3] - held[4:7]))
    carry = float(np.linalg.norm(held[4:7] - held[7:10]))
    expected = 0.2 * (1 - np.tanh(10 * reach)) + 0.2 + 0.6 * (1 - np.tanh(10 * carry))
    assert still.reward == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("task", [CARRY, REACH])
def test_rewards_lie_between_0_and_1_and_the_goal_gives_nearly_1(task):
    environment = SUITE.make(task, 0)
    random = np.random.default_rng(0)
    rewards = []
    for start in range(10):
        environment.reset(start)
        rewards += [environment.step(random.uniform(-1, 1, 4)).reward for _ in range(60)]
    assert min(rewards) >= 0.0
    assert max(rewards) <= 1.0
    observation = environment.reset(0)
    for _ in range(60):
        observation, reward, terminated, success = environment.step(follow_optimum(observation, task))
        assert not terminated
    assert success
    assert 0.95 < reward <= 1.0


def test_the_fewest_steps_by_hand():
    # 0.195 m along x: after 8 steps 0.035 m are left, more than the radius; after 9 steps 0.015 m.
    assert steps_between(np.zeros(3), np.array([0.195, 0.0, 0.0])) == 9
    assert steps_between(np.zeros(3), np.array([0.02, 0.0, 0.0])) == 0
    # All axes move at once: after 4 steps 0.015 m are left on each, 0.026 m together; after 5 nothing.
    assert steps_between(np.zeros(3), np.array([0.095, -0.095, 0.095])) == 5
    assert optimal_steps(REACH, observe(object=(0.195, 0.0, 0.2))) == 9
    # The tool is there in 4 steps, the fingers need 7; then 0.195 m to the goal take 9.
    near = observe(object=(0.095, 0.0, 0.2), goal=(0.29, 0.0, 0.2))
    assert optimal_steps(CARRY, near) == 7 + 9


@pytest.mark.parametrize(("task", "fewest", "most"), [(REACH, 5, 14), (CARRY, 11, 31)])
def test_a_scripted_policy_reaches_the_known_optimum(task, fewest, most):
    environment = SUITE.make(task, 0)
    known = [optimal_steps(task, environment.reset(start)) for start in range(300)]
    assert [steps_to_success(environment, task, start) for start in range(300)] == known
    assert fewest <= min(known) <= max(known) <= most


def success_over_random_proposals(task, rule, episodes=50, count=4):
    """The share of episodes, all stepped side by side, that ever succeed."""
    environments = [SUITE.make(task, 1) for _ in range(episodes)]
    observations = np.stack([environment.reset(start) for start, environment in enumerate(environments)])
    random, won = np.random.default_rng(0), np.zeros(episodes, bool)
    for _ in range(task.horizon):
        proposals = random.uniform(-1, 1, (episodes, count, 4)).astype(np.float32)
        actions, _ = select(proposals, task.adapters["paper"](observations), rule=rule)
        answers = [environment.step(act) for environment, act in zip(environments, actions, strict=True)]
        observations = np.stack([answer.observation for answer in answers])
        won |= [answer.success for answer in answers]
    return won.mean()


def test_the_selector_alone_reaches_but_cannot_carry():
    assert success_over_random_proposals(REACH, "hcpg") >= 0.95
    assert success_over_random_proposals(REACH, "first") <= 0.1
    assert success_over_random_proposals(CARRY, "hcpg") == 0.0


def test_start_states_repeat_for_a_seed_and_differ_between_seeds():
    one, same, other = (SUITE.make(CARRY, seed) for seed in (3, 3, 4))
    starts = [one.reset(start) for start in range(50)]
    one.step(np.ones(4))
    assert all((same.reset(start) == first).all() for start, first in enumerate(starts))
    mine = {first.tobytes() for first in starts}
    assert len(mine) == 50
    assert mine.isdisjoint({other.reset(start).tobytes() for start in range(50)})


def test_start_states_lie_inside_the_workspace_with_room_for_the_fingers():
    environment = SUITE.make(CARRY, 0)
    starts = np.stack([environment.reset(start) for start in range(500)])
    assert np.abs(starts[:, [0, 1]]).max() <= 0.1
    assert np.abs(starts[:, [4, 5, 7, 8]]).max() <= 0.2
    assert (starts[:, 6] == np.float32(0.02)).all()
    assert starts[:, 9].min() >= 0.1
    assert (starts[:, [3, 10]] == [1.0, 0.0]).all()


@pytest.mark.parametrize("action", [np.zeros(3), np.array([0.0, np.nan, 0.0, 0.0]), np.full(4, np.inf)])
def test_a_bad_action_is_refused(action):
    environment = SUITE.make(CARRY, 0)
    with pytest.raises(ValueError, match="four finite numbers"):
        environment.step(action)


def test_an_unknown_variant_is_refused():
    with pytest.raises(ValueError, match="no variant 'push'; it has reach, carry"):
        SUITE.make(replace(CARRY, env_id="push"), 0)


def test_the_picture_shows_where_things_are():
    environment = SUITE.make(CARRY, 0)
    first = environment.reset(0)
    picture = environment.render()
    assert (picture.shape, picture.dtype) == ((240, 480, 3), np.uint8)
    # 240 pixels are 0.56 m around the workspace's middle, (0, 0, 0.175); orange is the object on the table.
    rows, columns = np.nonzero((picture == (214, 120, 44)).all(axis=-1))
    above = columns < 240
    scale = 240 / 0.56
    assert columns[above].mean() == pytest.approx(120 + first[4] * scale, abs=1.5)
    assert rows[above].mean() == pytest.approx(120 - first[5] * scale, abs=1.5)
    assert columns[~above].mean() == pytest.approx(360 + first[4] * scale, abs=1.5)
    assert rows[~above].mean() == pytest.approx(120 - (0.02 - 0.175) * scale, abs=1.5)
    assert not (picture == (190, 48, 48)).all(axis=-1).any()
    bring_to_hold(environment)
    assert (environment.render() == (190, 48, 48)).all(axis=-1).any()
