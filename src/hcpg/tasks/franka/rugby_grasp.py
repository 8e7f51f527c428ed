"""Grasp a rugby ball across its short axis, lift it by 5 cm and hold it for a second."""

import numpy as np

from hcpg.interfaces import RobotTask, Task
from hcpg.robot_types import Sight, Snapshot
from hcpg.selection.geometry import funnel, moved
from hcpg.tasks.franka import (
    CONTROL,
    GOAL,
    GRIPPER,
    HELD,
    OBJECT,
    OBSERVATION_SIZE,
    TCP,
    Places,
    Steady,
    observer,
)
from hcpg.types import Float, Scene, Tensor

HELD_M = (0.045, 0.070)
"""Between fingers that hold the ball: it is 64 mm thick and soft, and nothing else stops them there."""
GOAL_HEIGHT_M = 0.132
"""Of the ball's middle, 10 cm above where it lies."""
ABOVE_M, STANDOFF_M = 0.012, 0.06
"""The fingers come down once this close to the ball's axis; until then they stay this far above it."""
LIFTED_M = 0.05


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Contact is the observed flag "held"; the direction of a held ball is up, as in the paper's lifting.

    Source: paper, equation (4).
    """
    ball, goal = observation[..., OBJECT], observation[..., GOAL]
    up = moved(0.0 * ball, z=goal[..., 2] - ball[..., 2])
    tool, held = observation[..., TCP], observation[..., HELD]
    return Scene(tool, ball, goal, ball - tool, up, held)


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The same, but the fingers come from above, so that they do not push the ball away."""
    scene = read_scene(observation)
    over = funnel(scene.tool, scene.object, ABOVE_M, STANDOFF_M)
    return scene._replace(approach=over - scene.tool)


class Lifted:
    """Watches the fingers and the arm alone: something stops the fingers, and is carried up with them."""

    def __init__(self) -> None:
        self._steady = Steady(ticks=30)
        self._grasped_at_m: float | None = None

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """Whether the ball is up and held, after one more tick."""
        holds = HELD_M[0] <= snapshot.gripper_width_m <= HELD_M[1]
        height = float(snapshot.position[2])
        if not holds:
            self._grasped_at_m = None
        elif self._grasped_at_m is None:
            self._grasped_at_m = height
        lifted = self._grasped_at_m is not None and height - self._grasped_at_m >= LIFTED_M
        return self._steady.update(lifted)


def _places(sight: Sight) -> Places:
    ball = np.asarray(sight["ball"].position)
    return ball, np.array([ball[0], ball[1], GOAL_HEIGHT_M])


ROBOT_TASK = RobotTask(
    observation_size=OBSERVATION_SIZE,
    action_size=4,
    objects=("ball",),
    observe=observer("ball", _places, HELD_M),
    home=(0.45, 0.0, 0.20),
    home_grip="open",
    make_detector=Lifted,
)
TASK = Task(
    "franka",
    "rugby-grasp",
    200,
    CONTROL + GRIPPER,
    {"paper": read_scene, "contact": read_contact_scene},
    ROBOT_TASK,
)
