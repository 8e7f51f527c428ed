"""Scripted experts: they see the truth, not what perception says, and stand in for a person who shows it.

Each is a function of one moment, so an expert that is pushed away simply goes on from where it is.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hcpg.types import Float

STEP_M = 0.010
"""What 1 in an action means."""
OPEN, CLOSE = 1.0, -1.0
GAIN = 2.5
"""Friction in the joints holds the arm against steps below about 2 mm, so small errors are overstated."""
ALIGNED_M = 0.0015
Vector = Float[np.ndarray, " 3"]


class Moment(NamedTuple):
    """What an expert looks at; positions in m."""

    tool: Vector
    """TCP."""
    tip: Vector
    object: Vector
    goal: Vector
    width_m: float


def act(task: str, moment: Moment, speed: float = 1.0) -> Float[np.ndarray, " A"]:
    """The expert's 3 numbers, 4 where the gripper is used; `speed` in (0, 1] scales its longest step."""
    delta, grip = _EXPERTS[task](moment)
    length = float(np.linalg.norm(delta))
    longest = speed * STEP_M
    delta = delta if length <= longest else delta * (longest / length)
    return np.array([*(delta / STEP_M), *grip])


def _insert(moment: Moment) -> tuple[Vector, tuple[float, ...]]:
    """Over the hole first; down once the peg is above it."""
    away = moment.object - moment.tip
    inside = away[2] > 0.002
    aligned = np.abs(away[:2]).max() < ALIGNED_M
    height = moment.goal[2] - 0.010 if aligned or inside else moment.object[2] + 0.010
    return GAIN * np.array([away[0], away[1], height - moment.tip[2]]), ()


def _press(moment: Moment) -> tuple[Vector, tuple[float, ...]]:
    """Over the button first, then through its lowest place."""
    away = moment.object - moment.tip
    over = np.linalg.norm(away[:2]) < 0.010
    height = moment.goal[2] - 0.010 if over else moment.object[2] + 0.020
    return GAIN * np.array([away[0], away[1], height - moment.tip[2]]), ()


def _close(moment: Moment) -> tuple[Vector, tuple[float, ...]]:
    """In front of the handle first, then through where it shall be."""
    away = moment.object - moment.tool
    in_front = np.abs(away[1:]).max() < (0.030 if away[0] < 0.020 else 0.012)
    ahead = moment.goal[0] + 0.010 if in_front else moment.object[0] - 0.035
    return GAIN * np.array([ahead - moment.tool[0], away[1], away[2]]), ()


def _grasp(moment: Moment) -> tuple[Vector, tuple[float, ...]]:
    """Over the ball, down around it, close, and up once the fingers have stopped on it."""
    away = moment.object - moment.tool
    if moment.width_m < 0.068 and np.linalg.norm(away) < 0.03:
        return GAIN * np.array([0.0, 0.0, moment.goal[2] + 0.02 - moment.tool[2]]), (CLOSE,)
    if np.linalg.norm(away) < 0.008:
        return GAIN * away, (CLOSE,)
    over = np.linalg.norm(away[:2]) < 0.005
    height = moment.object[2] if over or away[2] > -0.02 else moment.object[2] + 0.05
    return GAIN * np.array([away[0], away[1], height - moment.tool[2]]), (OPEN,)


_EXPERTS: dict[str, Callable[[Moment], tuple[Vector, tuple[float, ...]]]] = {
    "peg-insertion": _insert,
    "button-press": _press,
    "drawer-closing": _close,
    "rugby-grasp": _grasp,
}
