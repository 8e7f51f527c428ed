"""Bring the tool to the object: solved by any selector that reads the scene."""

import numpy as np

from hcpg.interfaces import RobotTask, Task
from hcpg.robot_types import Sight, Snapshot
from hcpg.types import Float, Scene, Tensor

RADIUS_M = 0.02
"""Tool to object at success."""
OPEN_M = 0.08
"""Between the fingers of an open gripper."""


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Tool and object as observed; there is no contact to wait for, so the approach is all that counts."""
    held = observation[..., 10]
    return Scene.of(observation[..., 0:3], observation[..., 4:7], observation[..., 4:7], held * 0.0)


TASK = Task(
    suite="point",
    env_id="reach",
    horizon=60,
    control="one unit moves the tool 0.02 m along an axis; above 0.5 the fourth entry closes the fingers",
    adapters={"paper": read_scene, "contact": read_scene},
)


def observe(snapshot: Snapshot, sight: Sight) -> Float[np.ndarray, " O"]:
    """The suite's observation, from an arm and its eyes; nothing is ever held."""
    opening = snapshot.gripper_width_m / OPEN_M
    parts = (snapshot.position, [opening], sight["object"].position, sight["goal"].position, [0.0])
    return np.concatenate(parts).astype(np.float32)


class Reached:
    """The tool is at the object."""

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """Whether it is now."""
        return bool(np.linalg.norm(snapshot.position - sight["object"].position) <= RADIUS_M)


ROBOT_TASK = RobotTask(
    observation_size=11,
    action_size=4,
    objects=("object", "goal"),
    observe=observe,
    home=(0.0, 0.0, 0.2),
    home_grip="open",
    make_detector=Reached,
)
