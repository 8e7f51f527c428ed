"""The fast twin as a suite: experts succeed, standing still does not, an episode follows from its start."""

import subprocess
import sys

import numpy as np
import pytest

from hcpg import registry

pytest.importorskip("mujoco")
NAMES = ("peg-insertion", "button-press", "drawer-closing", "rugby-grasp")
# Steps of the slowest of 15 starts at full speed, and a tenth more.
SLOWEST = {"peg-insertion": 64, "button-press": 66, "drawer-closing": 115, "rugby-grasp": 130}


@pytest.fixture(scope="module", params=NAMES)
def case(request):
    task = registry.task(f"franka/{request.param}")
    environment = registry.suite("franka").make(task, seed=100)
    yield task, environment
    environment.close()


def run(environment, start, steps, choose):
    """Steps to success (-1: never), and what was seen and earned on the way."""
    seen, rewards = [environment.reset(start)], []
    for step in range(steps):
        answer = environment.step(choose(environment, step))
        seen.append(answer.observation)
        rewards.append(answer.reward)
        if answer.success:
            return step + 1, np.array(seen), rewards
    return -1, np.array(seen), rewards


def test_the_expert_does_the_task_and_is_paid_for_it(case):
    task, environment = case
    steps, _, rewards = run(environment, 2, SLOWEST[task.env_id], lambda env, _: env.expert())
    assert steps > 10
    assert rewards[-1] > 0.9
    assert rewards[0] < 0.2
    assert all(0.0 <= reward <= 1.0 for reward in rewards)


def test_standing_still_does_not(case):
    task, environment = case
    still = np.zeros(task.robot.action_size)
    steps, seen, rewards = run(environment, 2, 15, lambda *_: still)
    assert steps == -1
    assert max(rewards) < 0.2
    assert np.linalg.norm(seen[-1][:3] - seen[0][:3]) < 0.002


def test_an_episode_follows_from_its_start_whatever_was_before(case):
    task, environment = case
    push = np.full(task.robot.action_size, 0.4)
    _, first, _ = run(environment, 5, 6, lambda *_: push)
    run(environment, 6, 2, lambda env, _: env.expert())
    _, again, _ = run(environment, 5, 6, lambda *_: push)
    np.testing.assert_array_equal(first, again)


def test_an_action_of_another_shape_or_not_finite_is_refused(case):
    _, environment = case
    environment.reset(0)
    with pytest.raises(ValueError, match=r"shape \(7,\)"):
        environment.step(np.zeros(7))
    with pytest.raises(ValueError, match="not finite"):
        environment.step(np.full(environment._robot.action_size, np.nan))


def test_one_step_moves_the_arm_no_further_than_its_limits(case):
    task, environment = case
    environment.reset(1)
    before = environment.step(np.zeros(task.robot.action_size)).observation[:3]
    for _ in range(8):
        after = environment.step(np.ones(task.robot.action_size) * 1.0).observation[:3]
        assert np.linalg.norm(after - before) < 0.010
        before = after


def test_the_object_is_seen_late_and_never_quite_where_it_is():
    environment = registry.suite("franka").make(registry.task("franka/rugby-grasp"), seed=100)
    errors, ages = [], []
    for start in range(40):
        observed = environment.reset(start)
        errors.append(observed[12:15] - environment._world.truth().object)
        ages.append(observed[18])
    # 2 mm on each axis, so 40 x 3 draws have a deviation within 30 % of it.
    assert np.std(errors) == pytest.approx(0.002, rel=0.3)
    assert 0.1 <= min(ages) <= max(ages) < 0.4


def test_a_second_of_processor_time_makes_at_least_250_steps():
    """In a process of its own: the tests' type checks at every call cost most of the time here."""
    code = (
        "import time, numpy as np; from hcpg import registry\n"
        "environment = registry.suite('franka').make(registry.task('franka/rugby-grasp'), 0)\n"
        "begun_s = time.process_time()\n"
        "for _ in range(100): environment.step(np.full(4, 0.1))\n"
        "print(100 / (time.process_time() - begun_s))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(told.stdout) > 250


def test_what_the_twin_lacks_is_refused_by_name():
    from dataclasses import replace

    suite, task = registry.suite("franka"), registry.task("franka/button-press")
    with pytest.raises(ValueError, match="no task 'door'; it has peg-insertion"):
        suite.make(replace(task, env_id="door"), 0)
    with pytest.raises(ValueError, match="got -1"):
        suite.make(task, -1)


def test_a_picture_shows_the_ball_where_it_is():
    environment = registry.suite("franka").make(registry.task("franka/rugby-grasp"), seed=100)
    environment.reset(0)
    picture = environment.render().astype(int)
    assert picture.shape == (480, 480, 3)
    red, green, blue = np.moveaxis(picture, -1, 0)
    orange = (red > 120) & (red > 1.6 * green) & (red > 2.5 * blue)
    assert 300 < orange.sum() < 5000
    environment.close()
    environment.close()
