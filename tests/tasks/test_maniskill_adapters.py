"""What ManiSkill's adapters read: by hand, and the same from every array library."""

import array_api_compat.torch as xp_torch
import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hcpg import registry
from hcpg.tasks.maniskill import pick_cube, poke_cube, pull_cube, push_cube

SIZES = {"push-cube": 35, "pull-cube": 35, "pick-cube": 42, "poke-cube": 54}
READERS = [
    (name, family)
    for name in (*SIZES, "pick-cube-lift")
    for family in registry.task(f"maniskill/{name}").adapters
]


def near(*numbers):
    return pytest.approx(numbers, abs=1e-9)


def planar_observation(tool, cube, goal=(0.3, 0.0, 0.001)):
    observation = np.zeros(35)
    observation[18:21], observation[25:28], observation[28:31] = tool, goal, cube
    return observation


def pick_observation(grasped):
    observation = np.zeros(42)
    observation[18], observation[19:22] = grasped, (0.0, 0.1, 0.2)
    observation[26:29], observation[29:32] = (0.1, 0.1, 0.3), (0.0, 0.0, 0.02)
    return observation


def poke_observation(tool, cube, peg=(0.0, 0.0, 0.025), turn=(1.0, 0.0, 0.0, 0.0), fingers=0.025):
    observation = np.zeros(54)
    observation[7:9], observation[18:21], observation[25:28] = fingers, tool, cube
    observation[32:35], observation[35:39] = peg, turn
    observation[39:42] = peg  # what the package calls the goal
    observation[48:51] = (0.1, 0.0, -0.019)
    observation[51:54] = np.add(peg, (0.12, 0.0, 0.0)) - cube  # what it calls the way from head to cube
    return observation


# --- every task ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "family"), READERS)
def test_every_library_reads_the_same_scene(name, family):
    read = registry.task(f"maniskill/{name}").adapters[family]
    size = SIZES[name.removesuffix("-lift")]
    observations = np.random.default_rng(0).uniform(-0.2, 0.2, (8, size)).astype(np.float32)
    observations[::2, 7:9], observations[:, 18:21] = 0.0245, observations[:, 18:21] * 0.2
    expected = read(observations)
    from_jax = jax.vmap(read)(observations)
    from_torch = read(xp_torch.asarray(observations))
    for mine, theirs, others in zip(expected, from_jax, from_torch, strict=True):
        if mine is None:
            assert theirs is None
            assert others is None
        else:
            assert np.asarray(theirs) == pytest.approx(mine, abs=1e-6)
            assert others.numpy() == pytest.approx(mine, abs=1e-6)


def test_the_control_mode_is_the_one_that_suits_the_task_and_the_other_is_a_variant():
    modes = {
        name: registry.task(f"maniskill/{name}").control.partition(":")[0]
        for name in (*SIZES, "push-cube-delta-pose", "pull-cube-delta-pose", "pick-cube-delta-pose")
    }
    translation, pose = "pd_ee_delta_pos", "pd_ee_delta_pose"
    assert list(modes.values()) == [translation, translation, translation, pose, pose, pose, pose]
    other = registry.task("maniskill/poke-cube-delta-pos")
    assert other.control.startswith("pd_ee_delta_pos:")
    assert other.adapters == registry.task("maniskill/poke-cube").adapters


# --- push and pull ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("module", "side"), [(push_cube, -1.0), (pull_cube, 1.0)])
def test_the_cube_is_taken_at_one_face_and_along_the_table(module, side):
    above = module.read_contact_scene(planar_observation([0.0, 0.0, 0.07], [0.0, 0.0, 0.02]))
    assert above.approach == near(side * 0.045, 0, -0.05)
    assert above.task == near(0.3, 0, 0)
    assert above.contact == 0
    behind = module.read_contact_scene(planar_observation([side * 0.05, 0.02, 0.04], [0.0, 0.0, 0.02]))
    wrong_side = module.read_contact_scene(planar_observation([-side * 0.05, 0.0, 0.02], [0.0, 0.0, 0.02]))
    beside = module.read_contact_scene(planar_observation([side * 0.05, 0.031, 0.02], [0.0, 0.0, 0.02]))
    higher = module.read_contact_scene(planar_observation([side * 0.05, 0.0, 0.051], [0.0, 0.0, 0.02]))
    farther = module.read_contact_scene(planar_observation([side * 0.081, 0.0, 0.02], [0.0, 0.0, 0.02]))
    flags = [float(scene.contact) for scene in (behind, wrong_side, beside, higher, farther)]
    assert flags == [1, 0, 0, 0, 0]


@pytest.mark.parametrize("module", [push_cube, pull_cube])
def test_the_papers_reading_takes_the_three_points_as_they_are(module):
    scene = module.read_paper_scene(planar_observation([0.0, 0.1, 0.2], [0.1, 0.0, 0.02]))
    assert scene.approach == near(0.1, -0.1, -0.18)
    assert scene.task == near(0.2, 0, -0.019)
    assert scene.contact is None


# --- pick ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("grasped", [0.0, 1.0])
def test_a_grasp_is_a_contact_and_the_goal_is_where_the_cube_goes(grasped):
    scene = pick_cube.read_scene(pick_observation(grasped))
    assert scene.contact == grasped
    assert scene.approach == near(0, -0.1, -0.18)
    assert scene.task == near(0.1, 0.1, 0.28)
    lifted = pick_cube.read_lift_scene(pick_observation(grasped))
    assert lifted.task == near(0, 0, 1)
    assert lifted.approach == near(0, -0.1, -0.18)


# --- poke ------------------------------------------------------------------------------------------------


def test_the_pegs_head_turns_with_the_peg():
    turns = Rotation.random(20, rng=0)
    observations = np.stack(
        [
            poke_observation([0, 0, 0.2], [0.3, 0, 0.02], turn=np.roll(turn, 1), peg=(0.1, 0.2, 0.3))
            for turn in turns.as_quat()
        ]
    )
    expected = turns.apply([0.12, 0.0, 0.0]) + np.array([0.1, 0.2, 0.3])
    assert poke_cube.peg_head(observations) == pytest.approx(expected, abs=1e-12)


def test_the_papers_reading_pokes_with_the_head_at_the_real_goal():
    scene = poke_cube.read_paper_scene(poke_observation([0.0, 0.0, 0.2], [0.22, 0.05, 0.02]))
    assert scene.tool == near(0.12, 0, 0.025)
    assert scene.goal == near(0.32, 0.05, 0.001)
    assert scene.approach == near(0.1, 0.05, -0.005)
    assert scene.task == near(0.1, 0, -0.019)
    assert scene.contact is None


@pytest.mark.parametrize(
    ("tool", "fingers", "contact"),
    [
        ([0.0, 0.0, 0.030], 0.025, 1),
        ([0.0, 0.0, 0.030], 0.0225, 1),
        ([0.0, 0.0, 0.030], 0.0215, 0),
        ([0.0, 0.0, 0.030], 0.0285, 0),
        ([0.0, 0.0, 0.030], 0.04, 0),
        ([0.0, 0.0, 0.090], 0.025, 0),
    ],
)
def test_fingers_as_wide_as_the_peg_and_near_it_hold_it(tool, fingers, contact):
    scene = poke_cube.read_contact_scene(poke_observation(tool, [0.22, 0.0, 0.02], fingers=fingers))
    assert scene.contact == contact
    assert scene.approach == near(0, 0, 0.025 - tool[2])
    assert scene.tool == (near(0.12, 0, 0.025) if contact else near(*tool))


def test_the_head_goes_in_line_first_then_on_to_the_goal_and_never_back():
    def task(cube_y, cube_x=0.22, gap=0.1):
        observation = poke_observation([0, 0, 0.03], [cube_x, cube_y, 0.02])
        observation[48] = gap
        return poke_cube.read_contact_scene(observation).task

    assert task(0.05) == near(0, 0.05, 0)
    assert task(-0.05) == near(0, -0.05, 0)
    assert task(0.011) == near(0.1, 0, 0)
    # Within 3 cm of the cube's face (0.12 + 0.03 + 0.02) the head pushes, in line or not.
    assert task(0.05, cube_x=0.169) == near(0.1, 0, 0)
    assert task(0.05, cube_x=0.171) == near(0, 0.05, 0)
    assert task(0.0, gap=-0.02) == near(0, 0, 0)
