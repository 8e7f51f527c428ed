"""ManiSkill's adapters against the simulator: what the observation holds, and what greedy motion achieves."""

from pathlib import Path

import numpy as np
import pytest

from hcpg import registry
from hcpg.tasks.maniskill import poke_cube

SUITE = "maniskill"
SCRIPTS = Path(__file__).parents[2] / "scripts"


def point(pose):
    return pose.p[0].numpy()


def turn_peg(stock, degrees):
    """Stand the peg askew, which no start state does."""
    import sapien

    half = np.radians(degrees) / 2
    stock.peg.set_pose(sapien.Pose([0.05, -0.02, 0.025], [np.cos(half), 0, 0, np.sin(half)]))


def observe(stock):
    return stock.get_obs(stock.get_info())[0].numpy()


@pytest.mark.parametrize(
    ("name", "cube", "goal"),
    [
        ("push-cube", "obj", "goal_region"),
        ("pull-cube", "obj", "goal_region"),
        ("pick-cube", "cube", "goal_site"),
        ("poke-cube", "cube", "goal_region"),
    ],
)
def test_tool_object_and_goal_are_the_simulators(make, name, cube, goal):
    environment, read = make(name), registry.task(f"maniskill/{name}").adapters["paper"]
    stock = environment._stepping.simulation
    for start in range(2):
        scene = read(environment.reset(start))
        tool = stock.peg_head_pose if name == "poke-cube" else stock.agent.tcp.pose
        assert scene.tool == pytest.approx(point(tool), abs=1e-6)
        assert scene.object == pytest.approx(point(getattr(stock, cube).pose), abs=1e-6)
        assert scene.goal == pytest.approx(point(getattr(stock, goal).pose), abs=1e-6)


def test_what_poke_cube_calls_the_goal_is_the_peg_and_ours_is_the_goal(make):
    environment = make("poke-cube")
    observation, stock = environment.reset(3), environment._stepping.simulation
    assert np.array_equal(observation[39:42], observation[poke_cube.PEG])
    goal = point(stock.goal_region.pose)
    assert np.linalg.norm(observation[39:42] - goal) > 0.3
    assert poke_cube.goal_of(observation) == pytest.approx(goal, abs=1e-6)


def test_poke_cubes_own_head_does_not_turn_with_the_peg_and_leads_the_other_way(make):
    environment = make("poke-cube")
    environment.reset(3)
    stock = environment._stepping.simulation
    turn_peg(stock, 90.0)
    observation = observe(stock)
    assert poke_cube.peg_head(observation) == pytest.approx([0.05, 0.10, 0.025], abs=1e-5)
    assert point(stock.peg_head_pose) == pytest.approx([0.05, 0.10, 0.025], abs=1e-5)
    package = observation[poke_cube.CUBE] + observation[51:54]
    assert package == pytest.approx([0.17, -0.02, 0.025], abs=1e-5)


@pytest.mark.parametrize("name", ["push-cube", "pull-cube", "pick-cube"])
def test_followed_greedily_the_contact_reading_solves_its_task(make, controls, name):
    task = registry.task(f"maniskill/{name}")
    act = controls.follow(name, task, task.adapters["contact"])
    outcome = controls.measure(make(name), act, episodes=5, steps=50)
    assert outcome.success == 1.0
    assert outcome.steps < 20


def test_followed_greedily_a_cube_is_poked_more_often_than_not(make, controls):
    task = registry.task("maniskill/poke-cube")
    act = controls.follow("poke-cube", task, task.adapters["contact"])
    assert controls.measure(make("poke-cube"), act, episodes=8, steps=50).success >= 0.5
    literal = controls.follow("poke-cube", task, task.adapters["paper"])
    assert controls.measure(make("poke-cube"), literal, episodes=2, steps=50).success == 0.0


@pytest.mark.parametrize(("name", "most"), [("push-cube", 0.4), ("pull-cube", 0.4), ("pick-cube-lift", 0.2)])
def test_the_papers_gate_opens_above_the_cube_and_its_lift_goes_past_the_goal(make, controls, name, most):
    task = registry.task(f"maniskill/{name}")
    act = controls.follow(name, task, task.adapters["paper"])
    outcome = controls.measure(make(name), act, episodes=5, steps=50, whole=True)
    assert outcome.success <= most
    assert outcome.success_at_end <= outcome.success


def test_the_picture_shows_the_gate_and_both_directions(make, controls, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(SCRIPTS)
    import adapter_pictures

    task = registry.task("maniskill/push-cube")
    read = task.adapters["contact"]
    act = controls.follow("push-cube", task, read)
    scenes, succeeded = adapter_pictures._record(make("push-cube"), act, read, 12)
    assert scenes.tool.shape == (12, 3)
    assert 0 < np.sum(scenes.contact) < 12
    assert not succeeded[0]
    assert succeeded[-1]
    file = adapter_pictures.draw(make("push-cube"), act, read, 12, tmp_path / "new/push.png")
    assert file.stat().st_size > 20_000
