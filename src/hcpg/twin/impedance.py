"""The law that pulls the TCP to its target: franky's Cartesian impedance tracking, written out in NumPy.

The served twin runs franky's own 1 kHz C++ loop instead; a test holds the two to each other.
"""

from typing import NamedTuple

import numpy as np

from hcpg.types import Float

TORQUE_LIMIT = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
"""Nm, of the FR3's joints."""
RATE_LIMIT_NM_S = 1000.0
"""Fastest change of a joint's torque: 1 Nm per millisecond, franky's default."""


class Gains(NamedTuple):
    """Of the impedance; damping is critical for a unit mass, 2 sqrt(stiffness), as in franky."""

    translation_n_m: float = 2000.0
    rotation_nm_rad: float = 100.0
    lead_m: float = 0.015
    """Bound of the position error along each axis: 30 N."""
    turn_rad: float = 0.04
    """Bound of the orientation error about each axis: 4 Nm."""
    posture_nm_rad: float = 10.0
    """Pull towards the start posture, within the null space."""


class Readings(NamedTuple):
    """What the law looks at."""

    position: Float[np.ndarray, " 3"]
    rotation: Float[np.ndarray, "3 3"]
    jacobian: Float[np.ndarray, "6 7"]
    joint_angles: Float[np.ndarray, " 7"]
    joint_speeds: Float[np.ndarray, " 7"]
    coriolis: Float[np.ndarray, " 7"]


class Impedance:
    """Joint torques for a target position, an orientation and a posture that stay the same."""

    def __init__(
        self, gains: Gains, rotation: Float[np.ndarray, "3 3"], posture: Float[np.ndarray, " 7"]
    ) -> None:
        self._gains, self._rotation, self._posture = gains, rotation, posture
        stiffness = np.repeat([gains.translation_n_m, gains.rotation_nm_rad], 3)
        self._stiffness, self._damping = stiffness, 2.0 * np.sqrt(stiffness)
        self._bound = np.repeat([gains.lead_m, gains.turn_rad], 3)
        self._last = np.zeros(7)

    def relax(self) -> None:
        """Forget the last torques, as of an arm that was put elsewhere."""
        self._last = np.zeros(7)

    def torques(
        self, readings: Readings, target: Float[np.ndarray, " 3"], elapsed_s: float
    ) -> Float[np.ndarray, " 7"]:
        """Nm, limited in size and, over the `elapsed_s` since the last call, in change."""
        jacobian, speeds = readings.jacobian, readings.joint_speeds
        error = np.concatenate([target - readings.position, turn(readings.rotation, self._rotation)])
        error = np.minimum(np.maximum(error, -self._bound), self._bound)
        wrench = self._stiffness * error - self._damping * (jacobian @ speeds)
        wanted = jacobian.T @ wrench + self._in_null_space(readings) + readings.coriolis
        change = RATE_LIMIT_NM_S * elapsed_s
        limited = self._last + np.minimum(np.maximum(wanted - self._last, -change), change)
        self._last = np.minimum(np.maximum(limited, -TORQUE_LIMIT), TORQUE_LIMIT)
        return self._last

    def _in_null_space(self, readings: Readings) -> Float[np.ndarray, " 7"]:
        """Posture torques less the part that would move the TCP."""
        stiffness = self._gains.posture_nm_rad
        pull = stiffness * (self._posture - readings.joint_angles)
        pull = pull - 2.0 * np.sqrt(stiffness) * readings.joint_speeds
        jacobian = readings.jacobian
        return pull - jacobian.T @ np.linalg.solve(jacobian @ jacobian.T, jacobian @ pull)


def turn(now: Float[np.ndarray, "3 3"], wanted: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """The small rotation from one orientation to another, as a vector in the base frame, rad."""
    skew = wanted @ now.T
    return 0.5 * np.array([skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]])
