"""The manufacturer's kinematics against the twin's model, and against itself by differences."""

import numpy as np
import pytest

from hcpg.robots.franka.kinematics import JOINT_LIMITS, flange_pose, point_velocity
from hcpg.robots.franka.setup import hand_frame

mujoco = pytest.importorskip("mujoco")


def test_the_tcp_is_where_the_twins_model_puts_it():
    from hcpg.twin.scenes import SCENES, build

    model = build(SCENES["button-press"], 0.002)
    data = mujoco.MjData(model)
    for angles in np.random.default_rng(1).uniform(JOINT_LIMITS[:, 0], JOINT_LIMITS[:, 1], (20, 7)):
        data.qpos[:7] = angles
        mujoco.mj_kinematics(model, data)
        pose = flange_pose(angles) @ hand_frame()
        np.testing.assert_allclose(pose[:3, 3], data.site("tcp").xpos, atol=1e-6)
        np.testing.assert_allclose(pose[:3, :3].ravel(), data.site("tcp").xmat, atol=1e-6)
    np.testing.assert_allclose(model.jnt_range[:7], JOINT_LIMITS)


def test_the_ready_pose_is_the_published_one():
    """At rest in the manufacturer's ready pose the flange is 554.5 mm ahead and 624.8 mm up, facing down."""
    pose = flange_pose(np.array([0, 0, 0, -1.57, 0, 1.57, np.pi / 4]))
    np.testing.assert_allclose(pose[:3, 3], [0.5544, 0.0, 0.6248], atol=2e-4)
    assert pose[2, 2] == pytest.approx(-1.0, abs=1e-4)


def test_a_point_moves_as_its_place_changes():
    angles, speeds = np.array([0.1, -0.3, 0.2, -2.4, 0.1, 2.1, 0.8]), np.linspace(-0.3, 0.4, 7)

    def place(at):
        return (flange_pose(at) @ hand_frame())[:3, 3]

    moved = (place(angles + 1e-6 * speeds) - place(angles - 1e-6 * speeds)) / 2e-6
    np.testing.assert_allclose(point_velocity(angles, speeds, place(angles)), moved, atol=1e-6)
