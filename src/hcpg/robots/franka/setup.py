"""What differs from arm to arm, and between an arm and its twin: frames, thresholds, gains."""

from typing import NamedTuple

import numpy as np

from hcpg.robot_types import Kind
from hcpg.types import Float

HAND_M = 0.1034
"""From the flange to the point between the finger pads."""


def hand_frame() -> Float[np.ndarray, "4 4"]:
    """The Franka hand's TCP in the flange's frame: turned by -45 degrees about z, 103.4 mm on."""
    side = np.sqrt(0.5)
    frame = np.eye(4)
    frame[:2, :2] = [[side, side], [-side, side]]
    frame[2, 3] = HAND_M
    return frame


class Setup(NamedTuple):
    """How one arm is set up."""

    kind: Kind
    realtime: bool
    """Whether a kernel without real-time scheduling is refused."""
    sets_frame: bool
    """Whether the end effector's frame is set from here; else it is set in Desk, and checked."""
    least_hand_kg: float
    """The end effector's mass that the controller has to know of; 0 where the twin knows none."""
    estimates_force: bool
    """Whether the controller estimates external forces."""
    rotation_nm_rad: float = 100.0
    turn_rad: float = 0.04
    """Bound of the orientation error: with the lead it keeps the wrist below its 12 Nm."""
    posture_nm_rad: float = 10.0
    collision_torque_nm: float = 20.0
    collision_force_n: float = 40.0
    """Beyond these the controller stops by itself."""
    grip_force_n: float = 20.0
    grip_speed_m_s: float = 0.1


ARM = Setup(kind="real", realtime=True, sets_frame=False, least_hand_kg=0.5, estimates_force=True)
SERVED_TWIN = Setup(kind="twin", realtime=False, sets_frame=True, least_hand_kg=0.0, estimates_force=False)
