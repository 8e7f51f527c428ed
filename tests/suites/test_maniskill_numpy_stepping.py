"""The NumPy stepping against ManiSkill's own, from the same start states under the same actions."""

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from hcpg import registry
from hcpg.suites.maniskill import ACTION_SIZES, control_mode, numpy_stepping
from hcpg.suites.maniskill.building import build_simulation
from hcpg.suites.maniskill.numpy_stepping import VERSIONS, NumpyStepping, VersionError, poses
from hcpg.suites.maniskill.stepping import TorchStepping

TASKS = tuple(name for name in registry.names("tasks") if name.startswith("maniskill/"))
GRASPING = ("maniskill/pick-cube", "maniskill/poke-cube")
SEEDS, STEPS = 20, 50
TOLERANCE = 1e-5


class Pair(NamedTuple):
    """One task built twice: as ManiSkill steps it and as we do."""

    stock: TorchStepping
    ours: NumpyStepping
    task: object
    actions: int


def build(name, mode=None):
    task = registry.task(name)
    mode = mode or control_mode(task)
    one, other = (build_simulation(task.env_id, mode) for _ in range(2))
    return Pair(TorchStepping(one), NumpyStepping(other, task.env_id), task, ACTION_SIZES[mode])


def purposeful(name, pair, observation, noise):
    """The task's own direction with a little noise, the fingers closing around what is to be carried."""
    scene = pair.task.adapters["contact"](observation)
    holds = scene.contact > 0.5
    action = 0.1 * noise
    action[:3] += np.clip((scene.task if holds else scene.approach) / 0.05, -1, 1)
    closes = holds or np.linalg.norm(scene.approach) < 0.01 or name not in GRASPING
    action[-1] = -1 if closes else 1
    return action


def both(name, pair, seed):
    """One episode stepped by ManiSkill and by us: observations, rewards and successes of each.

    Even seeds act on purpose, odd seeds at random, somewhat beyond the bounds.
    """
    noise = np.random.default_rng(seed).uniform(-1.2, 1.2, (STEPS, pair.actions)).astype(np.float32)
    theirs, ours = [(pair.stock.reset(seed), 0.0, False)], [(pair.ours.reset(seed), 0.0, False)]
    for each in noise:
        action = each if seed % 2 else purposeful(name, pair, theirs[-1][0], each)
        theirs.append(pair.stock.step(action))
        ours.append(pair.ours.step(action))
    return [[np.array(part) for part in zip(*answers, strict=True)] for answers in (theirs, ours)]


def compare(name, pair, seeds):
    """Hold whole episodes together; rewards and successes that were seen."""
    seen = []
    for seed in range(seeds):
        theirs, ours = both(name, pair, seed)
        np.testing.assert_allclose(ours[0], theirs[0], rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(ours[1], theirs[1], rtol=0, atol=TOLERANCE)
        np.testing.assert_array_equal(ours[2], theirs[2])
        assert ours[0].dtype == np.float32
        seen.append(theirs[1:])
    return (np.concatenate(part) for part in zip(*seen, strict=True))


@pytest.mark.parametrize("name", TASKS)
def test_trajectories_are_maniskills_own_over_twenty_episodes(name):
    rewards, successes = compare(name, build(name), SEEDS)
    assert successes.sum() >= 20, "too few successes to say anything about them"
    assert (rewards[~successes] > 0.4).sum() >= 5, "the later stages of the reward were not seen"


@pytest.mark.parametrize(
    ("name", "mode"), [(GRASPING[0], "pd_ee_delta_pose"), ("maniskill/poke-cube", "pd_ee_delta_pos")]
)
def test_so_are_they_in_the_other_control_mode(name, mode):
    rewards, _ = compare(name, build(name, mode), 2)
    assert rewards.max() > 0.4


@pytest.fixture(scope="module")
def poke():
    simulation = build_simulation("PokeCube-v1", "pd_ee_delta_pos")
    return NumpyStepping(simulation, "PokeCube-v1")


def ahead(point, x):
    return np.array([point[0] + x, *point[1:]], np.float32)


@pytest.mark.parametrize(
    ("apart_m", "to_goal_m", "at_least", "below"),
    [(0.1, 0.1, 0.4, 0.6), (0.0, 0.1, 0.7, 0.8), (0.0, 0.03, 0.7, 0.9)],
    ids=["peg held", "at the cube", "cube placed, arm moving"],
)
def test_the_stages_of_poking_are_maniskills(poke, monkeypatch, apart_m, to_goal_m, at_least, below):
    """The peg lies in the hand, its head this far from the cube: simple policies do not get to the cube."""
    poke.reset(0)
    simulation = poke.simulation
    pose_class = type(simulation.peg._objs[0].pose)
    peg = simulation.agent.tcp.pose.raw_pose[0, :3].numpy()
    cube = ahead(peg, 0.12 + 0.02 + apart_m)
    simulation.peg.set_pose(pose_class(peg, [1, 0, 0, 0]))
    simulation.cube.set_pose(pose_class(cube, [1, 0, 0, 0.001]))
    simulation.goal_region.set_pose(pose_class(ahead(cube, to_goal_m), [1, 0, 0, 0]))
    simulation.agent.robot.set_qvel(torch.full((9,), 0.3))
    monkeypatch.setattr(type(simulation.agent), "is_grasping", lambda *_: torch.tensor([True]))
    monkeypatch.setattr(poke._task._arm, "grasps", lambda _: True)
    info = simulation.get_info()
    expected = simulation.get_reward(simulation.get_obs(info), None, info)
    observation, reward, success = poke._task.answer()
    np.testing.assert_array_equal(observation, simulation.get_obs(info)[0].numpy())
    assert reward == pytest.approx(float(expected[0]), abs=1e-6)
    assert at_least <= reward < below
    assert success is bool(info["success"][0]) is False


def test_an_arm_that_cannot_reach_stays_where_it_is(poke):
    poke.reset(0)
    targets = []
    for _ in range(30):
        qpos = poke.simulation.agent.robot.get_qpos()[0].numpy()
        poke.step(np.array([1, 0, 0, 1], np.float32))
        target = [
            float(joint._objs[0].drive_target[0]) for joint in poke.simulation.agent.robot.active_joints
        ]
        targets.append(np.abs(np.array(target) - qpos)[:7].max())
    assert targets[0] > 0.01
    assert targets[-1] == 0.0


def test_another_version_is_refused_with_the_cure(monkeypatch):
    monkeypatch.setattr(numpy_stepping, "version", {"mani-skill": "3.0.1", "sapien": "3.1.0"}.get)
    with pytest.raises(
        VersionError, match=re.escape("sapien 3.0.3, but 3.1.0 is installed. Install sapien==")
    ):
        numpy_stepping.require_versions()


def test_the_project_pins_the_versions_that_the_formulas_are_of():
    """When this fails: compare the new version's formulas with those here, then move both."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert {f"{name}=={version}" for name, version in VERSIONS.items()} <= set(
        project["optional-dependencies"]["maniskill"]
    )
    assert {name: numpy_stepping.version(name) for name in VERSIONS} == VERSIONS


def test_an_unknown_control_mode_is_refused():
    simulation = build_simulation("PushCube-v1", "pd_ee_target_delta_pos")
    with pytest.raises(ValueError, match="'pd_ee_target_delta_pos' are not known here, only pd_ee_delta_pos"):
        NumpyStepping(simulation, "PushCube-v1")


def test_poses_are_turned_and_composed_as_scipy_does():
    random = np.random.default_rng(0)
    one, other = Rotation.random(2, random)
    (a, b), point = (
        (tuple(np.float32(each.as_quat(scalar_first=True))) for each in (one, other)),
        (3.0, -1.0, 2.0),
    )
    vector = tuple(np.float32(point))
    np.testing.assert_allclose(poses.rotate(a, vector), one.apply(point), atol=1e-5)
    np.testing.assert_allclose(poses.turned_y_axis(a), one.apply([0, 1, 0]), atol=1e-6)
    assert poses.yaw(a) == pytest.approx(one.as_euler("XYZ")[2], abs=1e-6)
    position, rotation = poses.compose((vector, a), (vector, b))
    np.testing.assert_allclose(position, point + one.apply(point), atol=1e-5)
    np.testing.assert_allclose(rotation, (one * other).as_quat(canonical=True, scalar_first=True), atol=1e-6)
    back, upright = poses.compose(poses.inverse((vector, a)), (vector, a))
    np.testing.assert_allclose((*back, *upright), (0, 0, 0, 1, 0, 0, 0), atol=1e-5)
