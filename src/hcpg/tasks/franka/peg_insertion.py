"""Insert a square peg, held in the hand, into a hole with 1 mm of play on each side."""

import numpy as np

from hcpg.interfaces import RobotTask, Task
from hcpg.robot_types import Sight, Snapshot
from hcpg.selection.geometry import flag, funnel, planar_distance
from hcpg.tasks.franka import (
    CONTROL,
    GOAL,
    OBJECT,
    OBSERVATION_SIZE,
    Places,
    Steady,
    below_tcp,
    beyond,
    observer,
)
from hcpg.types import Float, Scene, Tensor

PEG_TIP_M = 0.060
"""How far the peg's tip is beyond the TCP."""
DEPTH_M = 0.030
"""From the hole's mouth to where the tip shall be."""
ON_AXIS_M, STANDOFF_M = 0.004, 0.012
"""The tip is on the hole's axis when it is this close to it; until then it stays this far above the mouth."""
INSERTED_M, PLAY_M = 0.025, 0.006
"""Success: the tip this far below the mouth, no further than this from its axis, in three ticks in a row."""


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The peg's tip is the tool, the mouth of the hole the object, its depth the goal.

    Source: paper, equation (4).
    """
    return Scene.of(below_tcp(observation, PEG_TIP_M), observation[..., OBJECT], observation[..., GOAL])


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Over the mouth first; the peg's own way down begins once its tip is on the hole's axis."""
    tip, mouth = below_tcp(observation, PEG_TIP_M), observation[..., OBJECT]
    goal = observation[..., GOAL]
    on_axis = flag(planar_distance(tip, mouth) < ON_AXIS_M, observation)
    over = funnel(tip, mouth, ON_AXIS_M, STANDOFF_M)
    return Scene(tip, tip, goal, over - tip, goal - tip, on_axis)


class Inserted:
    """Measures how deep the tip is, by the arm's own joints."""

    def __init__(self) -> None:
        self._steady = Steady(ticks=3)

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """Whether the peg is in, after one more tick."""
        away = sight["hole"].position - beyond(snapshot, PEG_TIP_M)
        return self._steady.update(bool(np.abs(away[:2]).max() < PLAY_M and away[2] >= INSERTED_M))


def _places(sight: Sight) -> Places:
    mouth = np.asarray(sight["hole"].position)
    return mouth, mouth - [0.0, 0.0, DEPTH_M]


ROBOT_TASK = RobotTask(
    observation_size=OBSERVATION_SIZE,
    action_size=3,
    objects=("hole",),
    observe=observer("hole", _places),
    home=(0.45, 0.0, 0.24),
    home_grip="close",
    make_detector=Inserted,
)
TASK = Task(
    "franka", "peg-insertion", 150, CONTROL, {"paper": read_scene, "contact": read_contact_scene}, ROBOT_TASK
)
