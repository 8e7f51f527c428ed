"""Tasks of a Franka arm at 30 Hz: what their 19 observed numbers mean, and the pieces they are made of.

On the twin and on hardware the numbers are the same: the arm's own state, and where perception saw the
task's object. Positions are in the arm's base frame: x away from it, z up. The hand points down.
"""

from collections.abc import Callable

import numpy as np

from hcpg.robot_types import Sight, Snapshot
from hcpg.selection.geometry import rotated
from hcpg.types import Float, Scene, Tensor

CONTROL = (
    "one unit moves the TCP's target 0.01 m from where it is measured, along an axis of the base, at 30 Hz"
)
GRIPPER = "; the fourth entry opens the gripper from 0.5 up and closes it from -0.5 down"

TCP = slice(0, 3)
QUATERNION = slice(3, 7)
"""Of the hand, scalar last."""
VELOCITY = slice(7, 10)
OPENING = 10
"""Of the gripper, as a share of 80 mm."""
HELD = 11
"""1 where the fingers stand around the object, by their width and its place; 0 elsewhere."""
OBJECT = slice(12, 15)
GOAL = slice(15, 18)
AGE = 18
"""Of the object's sighting, s: 0 for a calibrated pose, at most 1."""
OBSERVATION_SIZE = 19

WIDEST_M = 0.08
"""Between the open fingers."""
NEAR_M = 0.05
"""No further from the TCP than this is what the fingers hold, also when it is seen where it was 0.3 s ago."""
Places = tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]]


def observer(
    name: str, places: Callable[[Sight], Places], held_m: tuple[float, float] | None = None
) -> Callable[[Snapshot, Sight], Float[Tensor, " O"]]:
    """What makes a task's observation: `places` gives object and goal, m.

    `held_m` are the narrowest and the widest gap between fingers that hold the object `name`; None where the
    task does not grasp.
    """

    def observe(snapshot: Snapshot, sight: Sight) -> Float[np.ndarray, " O"]:
        thing, goal = places(sight)
        observation = np.empty(OBSERVATION_SIZE, np.float32)
        observation[TCP], observation[QUATERNION] = snapshot.position, snapshot.quaternion
        observation[VELOCITY] = snapshot.velocity
        observation[OPENING] = snapshot.gripper_width_m / WIDEST_M
        observation[HELD] = held_m is not None and _held(snapshot, thing, held_m)
        observation[OBJECT], observation[GOAL] = thing, goal
        observation[AGE] = min(max(snapshot.host_time_s - sight[name].seen_s, 0.0), 1.0)
        return observation

    return observe


def read_paper_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """TCP, object and goal as observed; nothing observes a contact, so the distance gate decides.

    Source: paper, equation (4).
    """
    return Scene.of(observation[..., TCP], observation[..., OBJECT], observation[..., GOAL])


def below_tcp(observation: Float[Tensor, "*batch O"], distance_m: float) -> Float[Tensor, "*batch 3"]:
    """The point that far beyond the TCP along the hand's axis."""
    return observation[..., TCP] + rotated(observation[..., QUATERNION], (0.0, 0.0, distance_m))


def beyond(snapshot: Snapshot, distance_m: float) -> Float[Tensor, " 3"]:
    """The same point, of a snapshot."""
    return snapshot.position + rotated(np.asarray(snapshot.quaternion), (0.0, 0.0, distance_m))


class Steady:
    """Says that something holds once it has held for a number of ticks in a row."""

    def __init__(self, ticks: int) -> None:
        self._ticks, self._held_for = ticks, 0

    def update(self, holds: bool) -> bool:
        """Whether it has held for long enough, after one more tick."""
        self._held_for = self._held_for + 1 if holds else 0
        return self._held_for >= self._ticks


def _held(snapshot: Snapshot, thing: Float[Tensor, " 3"], held_m: tuple[float, float]) -> bool:
    narrowest_m, widest_m = held_m
    around = narrowest_m <= snapshot.gripper_width_m <= widest_m
    return around and float(np.linalg.norm(np.asarray(thing) - snapshot.position)) < NEAR_M
