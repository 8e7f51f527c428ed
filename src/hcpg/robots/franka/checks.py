"""What is looked at before the arm may move."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hcpg.robot_types import Check, Limits
from hcpg.robots.franka.kinematics import JOINT_LIMITS, flange_pose
from hcpg.robots.franka.link import Reading
from hcpg.robots.franka.setup import Setup, hand_frame
from hcpg.types import Float

AGREES_M, FRAME_OFF = 0.002, 0.002
TILTED_RAD = 0.1
JOINT_MARGIN_RAD = 0.05
READY = ("idle", "move")
WIDEST_M = 0.07
"""A gripper that was homed knows of at least this much."""


def checks(reading: Reading, widest_m: float, limits: Limits, setup: Setup) -> tuple[Check, ...]:
    """All of them; `widest_m` is the largest width that the gripper knows of."""
    state = reading.state
    return (*_condition(reading), *_frames(state, setup), *_place(state, limits), _gripper(widest_m))


def _condition(reading: Reading) -> Iterator[Check]:
    errors = str(reading.state.current_errors)
    fine = reading.mode in READY and errors == "[]"
    yield Check(
        "the controller is ready",
        fine,
        f"mode {reading.mode}, errors {errors}",
        "release the user stop, unlock the brakes and activate FCI in Desk; then connect again",
    )


def _frames(state: Any, setup: Setup) -> Iterator[Check]:
    off = float(np.abs(state.F_T_EE.matrix - hand_frame()).max())
    yield Check(
        "the end effector is the Franka hand",
        off < FRAME_OFF,
        f"F_T_EE is off by {off:.4f}",
        "choose the Franka hand as end effector in Desk, and no second offset anywhere",
    )
    expected = (flange_pose(np.array(state.q)) @ state.F_T_EE.matrix)[:3, 3]
    away = float(np.linalg.norm(state.O_T_EE.translation - expected))
    yield Check(
        "the frames agree",
        away < AGREES_M,
        f"the joint angles put the TCP {1000 * away:.1f} mm from where it is reported",
        "this is not an FR3, or its end effector is set wrongly",
    )
    yield Check(
        "the controller knows the hand's mass",
        state.m_ee >= setup.least_hand_kg,
        f"{state.m_ee:.2f} kg",
        "choose the Franka hand as end effector in Desk",
    )


def _place(state: Any, limits: Limits) -> Iterator[Check]:
    position = np.array(state.O_T_EE.translation)
    beyond = float(np.linalg.norm(position - np.clip(position, limits.box_low_m, limits.box_high_m)))
    found = f"TCP at {position.round(3).tolist()} m, {1000 * beyond:.0f} mm outside"
    yield Check("the TCP is in its box", beyond < limits.outside_m, found, "guide the arm into the box")
    tilt_rad = float(np.arccos(np.clip(-state.O_T_EE.matrix[2, 2], -1.0, 1.0)))
    found = f"tilted by {tilt_rad:.3f} rad, turned by {_turn_rad(state.O_T_EE.matrix):.3f} rad"
    upright = tilt_rad < TILTED_RAD and abs(_turn_rad(state.O_T_EE.matrix)) < TILTED_RAD
    cure = "guide the hand until it points down, with the fingers along the base's y"
    yield Check("the hand points down", upright, found, cure)
    angles = np.array(state.q)
    margin = float(np.minimum(angles - JOINT_LIMITS[:, 0], JOINT_LIMITS[:, 1] - angles).min())
    found = f"{margin:.2f} rad to the nearest"
    cure = "guide the arm away from that limit"
    yield Check("the joints are off their limits", margin > JOINT_MARGIN_RAD, found, cure)


def _gripper(widest_m: float) -> Check:
    cure = "home the gripper in Desk, with nothing between its fingers"
    return Check("the gripper is homed", widest_m >= WIDEST_M, f"widest {1000 * widest_m:.0f} mm", cure)


def _turn_rad(pose: Float[np.ndarray, "4 4"]) -> float:
    """How far a hand that points down is turned about the vertical."""
    return float(np.arctan2(-pose[1, 0], pose[0, 0]))
