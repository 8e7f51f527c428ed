"""The scenes against numbers from elsewhere: the FR3's published DH table and what the docstrings promise."""

import json
import subprocess

import numpy as np
import pytest

from hcpg.twin.bodies import HOME_ANGLES, Addresses, angles_for
from hcpg.twin.launching import PYTHON, is_installed
from hcpg.twin.scenes import SCENES, build, layout, scene

mujoco = pytest.importorskip("mujoco")
# Franka Robotics, FR3: a, d and alpha of the modified Denavit-Hartenberg convention, joints 1 to 7; m, rad.
DH = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
]
FLANGE_M, HAND_M = 0.107, 0.1034


def link(a, d, alpha, theta):
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [[c, -s, 0, a], [s * ca, c * ca, -sa, -d * sa], [s * sa, c * sa, ca, d * ca], [0, 0, 0, 1]]
    )


def tool_by_hand(angles):
    pose = np.eye(4)
    for (a, d, alpha), theta in zip(DH, angles, strict=True):
        pose = pose @ link(a, d, alpha, theta)
    return (pose @ [0, 0, FLANGE_M + HAND_M, 1])[:3]


@pytest.fixture(scope="module")
def models():
    return {task: build(each, 0.002) for task, each in SCENES.items()}


def test_the_arm_has_the_kinematics_of_the_published_table(models):
    model = models["button-press"]
    data = mujoco.MjData(model)
    for angles in np.random.default_rng(0).uniform(-1.0, 1.0, (20, 7)):
        data.qpos[:7] = angles
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.site("tcp").xpos, tool_by_hand(angles), atol=1e-6)


def test_the_arm_weighs_what_its_links_weigh(models):
    model = models["button-press"]
    links = [model.body(f"fr3_link{number}").mass[0] for number in range(1, 8)]
    assert sum(links) == pytest.approx(2.92747 + 2.93554 + 2.2449 + 2.6156 + 2.32712 + 1.81704 + 0.627143)
    assert model.body("hand").mass[0] == pytest.approx(0.73)


@pytest.mark.parametrize("task", SCENES)
def test_gravity_is_compensated_for_the_robot_alone(models, task):
    model = models[task]
    compensated = {
        model.body(number).name for number in range(model.nbody) if model.body_gravcomp[number] == 1
    }
    arm = {f"fr3_link{number}" for number in range(1, 8)} | {"hand", "left_finger", "right_finger"}
    assert compensated == arm | ({"peg"} if task == "peg-insertion" else set())


def test_the_things_have_the_dimensions_they_are_said_to_have(models):
    assert models["peg-insertion"].geom("peg").size.tolist() == [0.010, 0.010, 0.035]
    button = models["button-press"].joint("button")
    assert (button.stiffness[0], button.range.tolist()) == (400.0, [0.0, 0.012])
    drawer = models["drawer-closing"].joint("drawer")
    assert models["drawer-closing"].dof_frictionloss[drawer.dofadr[0]] == 1.5
    ball = models["rugby-grasp"]
    assert (2 * ball.geom("ball").size).tolist() == [0.110, 0.064, 0.064]
    assert ball.body("fixture").mass[0] == pytest.approx(0.080)


def test_the_hole_leaves_a_millimetre_on_each_side(models):
    """Rays from the middle of the hole, 20 mm below its mouth, meet its walls 11 mm away."""
    model = models["peg-insertion"]
    data = mujoco.MjData(model)
    data.qpos[:7] = HOME_ANGLES
    mujoco.mj_forward(model, data)
    middle = data.site("object").xpos - [0, 0, 0.020]
    geom = np.zeros(1, np.int32)
    for direction in np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]):
        found = mujoco.mj_ray(model, data, middle, direction, None, 1, -1, geom)
        assert found == pytest.approx(0.011, abs=1e-6)


def test_angles_put_the_tool_where_it_was_asked_for(models):
    model = models["button-press"]
    data, at = mujoco.MjData(model), Addresses.of(model)
    data.qpos[at.arm] = angles_for(model, np.array([0.5, -0.1, 0.15]), HOME_ANGLES)
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.site_xpos[at.tcp], [0.5, -0.1, 0.15], atol=2e-5)
    np.testing.assert_allclose(data.site_xmat[at.tcp].reshape(3, 3), np.diag([1, -1, -1]), atol=2e-5)


def test_a_place_out_of_reach_is_refused(models):
    with pytest.raises(ValueError, match="cannot reach"):
        angles_for(models["button-press"], np.array([1.2, 0.0, 0.2]), HOME_ANGLES)


@pytest.mark.parametrize("task", SCENES)
def test_layouts_stay_within_their_spread_and_differ(task):
    of = SCENES[task]
    drawn = [layout(of, 3, start) for start in range(200)]
    fixtures = np.array([each.fixture for each in drawn])
    assert (np.abs(fixtures - of.fixture) <= np.array(of.spread) + 1e-12).all()
    assert np.ptp(fixtures[:, :2], axis=0) == pytest.approx(2 * np.array(of.spread[:2]), rel=0.05)
    assert all(abs(each.yaw_rad) <= of.yaw_rad for each in drawn)
    assert len({tuple(each.start) for each in drawn}) == 200


def test_a_layout_follows_from_its_two_numbers():
    one, again, other = (layout(SCENES["rugby-grasp"], seed, 7) for seed in (0, 0, 1))
    np.testing.assert_array_equal(one.fixture, again.fixture)
    assert (one.fixture[:2] != other.fixture[:2]).all()


def test_an_unknown_task_is_named_with_those_there_are():
    with pytest.raises(ValueError, match="no task 'peg'; it has peg-insertion, button-press"):
        scene("peg")


@pytest.mark.skipif(not is_installed(), reason="the served twin's environment is missing: run `make twin`")
def test_the_served_twins_older_mujoco_builds_the_same_scenes(models):
    code = (
        "import json, mujoco, numpy\n"
        "from hcpg.twin.scenes import SCENES, build\n"
        "models = {task: build(each, 0.002) for task, each in SCENES.items()}\n"
        "told = lambda m: [m.nq, m.ngeom, float(m.body_mass.sum()), float(m.jnt_range.sum())]\n"
        "facts = {task: told(model) for task, model in models.items()}\n"
        "print(json.dumps([mujoco.__version__, numpy.__version__, facts]))"
    )
    told = subprocess.run([str(PYTHON), "-c", code], capture_output=True, text=True, check=True)
    of_mujoco, of_numpy, facts = json.loads(told.stdout)
    assert (of_mujoco, of_numpy) == ("3.2.7", "1.26.4")
    for task, model in models.items():
        ours = [model.nq, model.ngeom, model.body_mass.sum(), model.jnt_range.sum()]
        assert facts[task] == pytest.approx(ours, rel=1e-9)
