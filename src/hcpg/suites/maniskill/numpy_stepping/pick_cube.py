"""PickCube: what ManiSkill observes, rewards and calls a success."""

import math
from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.arm import Arm
from hcpg.suites.maniskill.numpy_stepping.measures import closeness, distance
from hcpg.types import Float

LARGEST_REWARD = 5


class PickCube:
    """Reads one simulation of PickCube."""

    def __init__(self, simulation: Any) -> None:
        self._arm, self._goal_radius = Arm(simulation), simulation.goal_thresh
        self._cube, self._goal = simulation.cube._objs[0], simulation.goal_site._objs[0]
        self._cube_body = simulation.cube._bodies[0]

    def answer(self) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, reward and success, now."""
        posture, cube, goal = self._arm.posture(), self._cube.pose, self._goal.pose.p
        position, grasped = cube.p, self._arm.grasps(self._cube_body)
        qpos, qvel, tcp, tcp_rotation = posture
        parts = (
            qpos,
            qvel,
            [grasped],
            tcp,
            tcp_rotation,
            goal,
            position,
            cube.q,
            position - tcp,
            goal - position,
        )
        observation = np.concatenate(parts, dtype=np.float32)
        gap = distance(goal, position)
        placed = gap <= self._goal_radius
        if placed and posture.is_static:
            return observation, 1.0, True
        reward = closeness(distance(position, tcp))
        reward += 1 + closeness(gap) if grasped else 0.0
        reward += closeness(math.hypot(*posture.arm_speeds.tolist())) if placed else 0.0
        return observation, reward / LARGEST_REWARD, False
