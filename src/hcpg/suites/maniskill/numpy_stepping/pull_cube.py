"""PullCube: what ManiSkill observes, rewards and calls a success."""

from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.arm import Arm
from hcpg.suites.maniskill.numpy_stepping.measures import closeness, distance, planar_distance
from hcpg.types import Float

CLEARANCE_M = 0.01
REACHED_M = 0.01
LARGEST_REWARD = 3


class PullCube:
    """Reads one simulation of PullCube."""

    def __init__(self, simulation: Any) -> None:
        self._arm, self._goal_radius = Arm(simulation), simulation.goal_radius
        self._cube, self._goal = simulation.obj._objs[0], simulation.goal_region._objs[0]
        self._beyond = np.array([simulation.cube_half_size + CLEARANCE_M, 0, 0], np.float32)

    def answer(self) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, reward and success, now."""
        posture, cube, goal = self._arm.posture(), self._cube.pose, self._goal.pose.p
        position = cube.p
        observation = np.concatenate((*posture, goal, position, cube.q))
        gap = planar_distance(position, goal)
        if gap < self._goal_radius:
            return observation, 1.0, True
        to_cube = distance(position + self._beyond, posture.tcp)
        reward = closeness(to_cube) + (closeness(gap) if to_cube < REACHED_M else 0.0)
        return observation, reward / LARGEST_REWARD, False
