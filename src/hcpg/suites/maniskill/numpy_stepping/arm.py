"""The robot of one simulation, as NumPy sees it."""

import math
from typing import Any, NamedTuple

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.poses import turned_y_axis
from hcpg.types import Float

FINGER_JOINTS = 2
"""How many joints, the last ones, are fingers."""
SLOWEST_RAD_S = 0.2
"""An arm whose joints are all slower stands still."""
LEAST_FORCE_N = 0.5
LARGEST_ANGLE_DEG = 85.0
"""A finger holds what it presses with that force, within that angle of the direction it opens in."""


class Posture(NamedTuple):
    """Where the robot is, and how fast it moves."""

    qpos: Float[np.ndarray, " Q"]
    qvel: Float[np.ndarray, " Q"]
    tcp: Float[np.ndarray, " 3"]
    """The point between the fingertips, m."""
    tcp_rotation: Float[np.ndarray, " 4"]

    @property
    def arm_speeds(self) -> Float[np.ndarray, " J"]:
        """Of the joints without the fingers, rad/s."""
        return self.qvel[:-FINGER_JOINTS]

    @property
    def is_static(self) -> bool:
        """Whether every joint of the arm stands (nearly) still."""
        return bool(np.abs(self.arm_speeds).max() <= SLOWEST_RAD_S)


class Arm:
    """Reads the robot's joints, the point between its fingertips, and what its fingers press."""

    def __init__(self, simulation: Any) -> None:
        agent = simulation.agent
        self._articulation, self._tcp = agent.robot._objs[0], agent.tcp._objs[0]
        self._fingers = [(agent.finger1_link._objs[0], 1.0), (agent.finger2_link._objs[0], -1.0)]
        self._scene, self._timestep_s = simulation.scene, simulation.scene.px.timestep

    def posture(self) -> Posture:
        """Joints and tool point as they are now."""
        pose = self._tcp.entity_pose
        return Posture(self._articulation.qpos, self._articulation.qvel, pose.p, pose.q)

    def grasps(self, body: Any) -> bool:
        """Whether both fingers press the body from inside; `body` is one of SAPIEN's."""
        contacts = [contact for contact in self._scene.px.get_contacts() if body in contact.bodies]
        return bool(contacts) and all(self._presses(*finger, body, contacts) for finger in self._fingers)

    def _presses(self, finger: Any, side: float, body: Any, contacts: list[Any]) -> bool:
        impulse = np.zeros(3)
        for contact in contacts:
            if finger in contact.bodies:
                sign = 1 if contact.bodies[0] == finger else -1
                impulse += sign * np.sum([point.impulse for point in contact.points], axis=0)
        force = math.hypot(*impulse) / self._timestep_s
        if force < LEAST_FORCE_N:
            return False
        opening = [side * float(part) for part in turned_y_axis(tuple(finger.entity_pose.q))]
        cosine = float(np.dot(opening, impulse)) / (math.hypot(*opening) * math.hypot(*impulse))
        return math.degrees(math.acos(max(-1.0, min(1.0, cosine)))) <= LARGEST_ANGLE_DEG
