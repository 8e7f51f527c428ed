"""Push a drawer shut with closed fingers."""

import numpy as np

from hcpg.interfaces import RobotTask, Task
from hcpg.robot_types import Sight, Snapshot
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag, moved
from hcpg.tasks.franka import (
    CONTROL,
    GOAL,
    OBJECT,
    OBSERVATION_SIZE,
    TCP,
    Places,
    Steady,
    observer,
    read_paper_scene,
)
from hcpg.types import Float, Scene, Tensor

LEVEL_M, STANDOFF_M = 0.025, 0.04
"""The fingers are level with the handle when this close to its line; until then they stay in front of it."""
SHUT_M = 0.008
"""Success: the drawer is open by less than this, in three ticks in a row."""


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """In front of the handle first; pushing begins once the fingers are at its height and side."""
    tool, handle, goal = observation[..., TCP], observation[..., OBJECT], observation[..., GOAL]
    aside = length(moved(handle - tool, x=tool[..., 0] - handle[..., 0]))
    level = flag(aside < LEVEL_M, observation)
    target = moved(handle, x=-STANDOFF_M * (1.0 - level))
    return Scene(tool, handle, goal, target - tool, goal - handle, level)


class Shut:
    """Compares where the drawer is with where it is when closed."""

    def __init__(self) -> None:
        self._steady = Steady(ticks=3)

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """Whether the drawer is shut, after one more tick."""
        opening = sight["cabinet"].position[0] - sight["drawer"].position[0]
        return self._steady.update(bool(opening < SHUT_M))


def _places(sight: Sight) -> Places:
    return np.asarray(sight["drawer"].position), np.asarray(sight["cabinet"].position)


ROBOT_TASK = RobotTask(
    observation_size=OBSERVATION_SIZE,
    action_size=3,
    objects=("drawer", "cabinet"),
    observe=observer("drawer", _places),
    home=(0.36, 0.0, 0.12),
    home_grip="close",
    make_detector=Shut,
)
TASK = Task(
    "franka",
    "drawer-closing",
    300,
    CONTROL,
    {"paper": read_paper_scene, "contact": read_contact_scene},
    ROBOT_TASK,
)
"""The object is the drawer's handle, the goal where the handle is when the drawer is shut."""
