"""PokeCube: what ManiSkill observes, rewards and calls a success.

The observation repeats the peg's position where ManiSkill's label says goal.
"""

import math
from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.arm import Arm
from hcpg.suites.maniskill.numpy_stepping.measures import closeness, distance, planar_distance
from hcpg.suites.maniskill.numpy_stepping.poses import yaw
from hcpg.types import Float

REACHED_M = 0.01
TOUCHING_M = 0.005
ALIGNED_RAD = 0.05
LARGEST_REWARD = 10


class PokeCube:
    """Reads one simulation of PokeCube."""

    def __init__(self, simulation: Any) -> None:
        self._arm, self._goal_radius = Arm(simulation), simulation.goal_radius
        self._cube, self._goal, self._peg = (
            getattr(simulation, name)._objs[0] for name in ("cube", "goal_region", "peg")
        )
        self._peg_body = simulation.peg._bodies[0]
        self._to_head = np.array([simulation.peg_half_length, 0, 0], np.float32)
        self._touching_m = simulation.cube_half_size + TOUCHING_M

    def answer(self) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, reward and success, now."""
        posture, cube, peg, goal = self._arm.posture(), self._cube.pose, self._peg.pose, self._goal.pose.p
        at, peg_at = cube.p, peg.p
        head = peg_at + self._to_head
        differences = (peg_at - posture.tcp, at - peg_at, goal - at, head - at)
        observation = np.concatenate((*posture, at, cube.q, peg_at, peg.q, peg_at, *differences))
        placed = planar_distance(at, goal) < self._goal_radius
        if placed and posture.is_static:
            return observation, 1.0, True
        tilt = abs(yaw(tuple(peg.q)) - yaw(tuple(cube.q)))
        reward = self._progress(
            distance(posture.tcp, peg_at), planar_distance(head, at), tilt, distance(goal, at)
        )
        reward += closeness(math.hypot(*posture.arm_speeds.tolist())) if placed else 0.0
        return observation, reward / LARGEST_REWARD, False

    def _progress(self, to_peg: float, to_cube: float, tilt: float, to_goal: float) -> float:
        """The reward of the furthest of three stages: reach the peg, bring it to the cube, push."""
        if not (to_peg < REACHED_M and self._arm.grasps(self._peg_body)):
            return 2 * closeness(to_peg)
        if not (tilt < ALIGNED_RAD and to_cube <= self._touching_m):
            return 4 + closeness(to_cube) + closeness(tilt)
        return 7 + closeness(to_goal)
