"""PushCube: what ManiSkill observes, rewards and calls a success."""

from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.arm import Arm
from hcpg.suites.maniskill.numpy_stepping.measures import closeness, distance, planar_distance
from hcpg.types import Float

CLEARANCE_M = 0.005
REACHED_M = 0.01
ON_TABLE_M = 0.005
LARGEST_REWARD = 4


class PushCube:
    """Reads one simulation of PushCube."""

    def __init__(self, simulation: Any) -> None:
        self._arm, self._goal_radius = Arm(simulation), simulation.goal_radius
        self._cube, self._goal = simulation.obj._objs[0], simulation.goal_region._objs[0]
        self._half_size = simulation.cube_half_size
        self._behind = np.array([-self._half_size - CLEARANCE_M, 0, 0], np.float32)

    def answer(self) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, reward and success, now."""
        posture, cube, goal = self._arm.posture(), self._cube.pose, self._goal.pose.p
        position = cube.p
        observation = np.concatenate((*posture, goal, position, cube.q))
        height, gap = float(position[2]), planar_distance(position, goal)
        success = gap < self._goal_radius and height < self._half_size + ON_TABLE_M
        if success:
            return observation, 1.0, True
        to_cube = distance(position + self._behind, posture.tcp)
        reward = closeness(to_cube)
        if to_cube < REACHED_M:
            reward += closeness(gap) * (1 + closeness(abs(height - self._half_size)))
        return observation, reward / LARGEST_REWARD, False
