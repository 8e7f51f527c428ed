"""What is refused before the arm moves, on states made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from hcpg import registry
from hcpg.robot_types import RobotError
from hcpg.robots import franka
from hcpg.robots.franka.checks import checks
from hcpg.robots.franka.kinematics import flange_pose
from hcpg.robots.franka.link import Reading
from hcpg.robots.franka.setup import ARM, hand_frame

READY = np.array([0.0, -0.35, 0.0, -2.5, 0.0, 2.15, 0.785])


def affine(matrix):
    return SimpleNamespace(matrix=matrix, translation=matrix[:3, 3])


def reading(angles=READY, frame=None, mode="idle", errors="[]", shift_m=0.0, m_ee=0.73):
    frame = hand_frame() if frame is None else frame
    pose = flange_pose(angles) @ frame
    pose[0, 3] += shift_m
    state = SimpleNamespace(
        q=angles, F_T_EE=affine(frame), O_T_EE=affine(pose), m_ee=m_ee, current_errors=errors
    )
    return Reading(state, 1, 0.0, mode)


def failed(looked_at, widest_m=0.08):
    return [each.name for each in checks(looked_at, widest_m, franka.LIMITS, ARM) if not each.passed]


def test_an_arm_that_is_set_up_passes():
    assert failed(reading()) == []


def test_each_thing_that_is_wrong_is_named():
    assert failed(reading(mode="user_stopped")) == ["the controller is ready"]
    assert failed(reading(errors="[reflex]")) == ["the controller is ready"]
    assert failed(reading(frame=np.eye(4))) == ["the end effector is the Franka hand", "the hand points down"]
    assert failed(reading(shift_m=0.107)) == ["the frames agree"]
    assert failed(reading(m_ee=0.0)) == ["the controller knows the hand's mass"]
    assert failed(reading(), widest_m=0.0) == ["the gripper is homed"]


def test_an_arm_elsewhere_is_not_moved():
    turned = READY + np.array([0, 0, 0, 0, 0, 0, 0.3])
    assert failed(reading(angles=turned)) == ["the hand points down"]
    aside = READY + np.array([1.2, 0, 0, 0, 0, 0, 1.2])
    assert failed(reading(angles=aside)) == ["the TCP is in its box"]
    folded = np.array([0.0, -1.4, 0.0, -3.0, 0.0, 1.6, 0.785])
    assert "the joints are off their limits" in failed(reading(angles=folded))


def test_every_failed_check_tells_the_cure():
    found = checks(reading(frame=np.eye(4), mode="reflex", m_ee=0.0), 0.0, franka.LIMITS, ARM)
    assert all(each.cure for each in found if not each.passed)


@pytest.mark.parametrize(
    ("task", "address", "message"),
    [
        ("franka/peg-insertion", None, "give it, e.g. --address"),
        ("franka/peg-insertion", "127.0.0.1", "use --robot twin"),
        ("franka/rugby-grasp", "172.16.0.2", "this rig has no camera"),
        ("point/carry", "172.16.0.2", "it can do franka/peg-insertion, franka/button-press"),
    ],
)
def test_the_arm_refuses_what_it_cannot_do(task, address, message, monkeypatch):
    monkeypatch.setattr(franka, "has_driver", lambda: True)
    with pytest.raises(RobotError, match=message):
        registry.robot("franka").make(task, address)


def test_without_its_driver_the_arm_says_what_to_install(monkeypatch):
    monkeypatch.setattr(franka, "has_driver", lambda: False)
    with pytest.raises(RobotError, match=r"pip install 'hcpg-flow\[franka\]'"):
        registry.robot("franka").make("franka/peg-insertion", "172.16.0.2")


def test_the_arm_has_the_twins_limits():
    from hcpg.twin.limits import limits

    assert registry.robot("franka").kind == "real"
    for task in ("peg-insertion", "button-press"):
        assert franka.task_limits(f"franka/{task}") == limits(task)
