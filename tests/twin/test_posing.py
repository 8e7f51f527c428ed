"""A scene put back as a log has it, against the physics that the log would come from."""

import numpy as np
import pytest

from hcpg.twin.posing import Posing, quaternion_of
from hcpg.twin.scenes import SCENES
from hcpg.twin.world import World

pytest.importorskip("mujoco")


def sights(world):
    return {**world.surveyed(), **world.moving()}


@pytest.mark.parametrize("task", SCENES)
def test_arm_and_things_stand_where_the_physics_had_them(task):
    world = World(task, 1_000_000)
    world.place(3)
    world.sleep_until(0.2)
    physics, posing = world.physics, Posing(task)
    posing.pose(physics.joint_angles, physics.width_m, sights(world))
    for name in ("tcp", "tip", "object"):
        # What was touched off is 0.3 mm off on each axis; 4 standard deviations.
        there, here = posing.data.site(name).xpos, physics.data.site(name).xpos
        np.testing.assert_allclose(there, here, atol=1e-6 if name != "object" else 0.0012)
    names = [name for name, _ in posing.bodies()]
    assert {"fr3_link0", "fr3_link7", "hand", "left_finger", "right_finger"} <= set(names)
    assert {shape.body for shape in posing.shapes()} <= set(names)


def test_every_mesh_has_its_faces_and_lies_in_its_body():
    posing = Posing("peg-insertion")
    meshes = [shape for shape in posing.shapes() if shape.kind == "mesh"]
    assert len(meshes) == 9
    for shape in meshes:
        assert shape.faces.min() == 0
        assert shape.faces.max() == len(shape.vertices) - 1
        assert np.ptp(shape.vertices, axis=0).max() < 0.5


def test_a_button_is_as_deep_as_the_tip_that_is_over_it():
    posing = Posing("button-press")
    tip = posing.data.site("tip").xpos
    angles = posing.data.qpos[:7].copy()
    for depth_m, expected in ((0.007, 0.007), (0.05, 0.012), (-0.01, 0.0)):
        posing.pose(angles, 0.0, {"button": tip + np.array([0.0, 0.0, depth_m])})
        assert posing.data.joint("button").qpos[0] == pytest.approx(expected)
    posing.pose(angles, 0.0, {"button": tip + np.array([0.03, 0.0, 0.007])})
    assert posing.data.joint("button").qpos[0] == 0.0


def test_a_quarter_turn_about_the_vertical():
    frame = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert quaternion_of(frame) == pytest.approx([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
