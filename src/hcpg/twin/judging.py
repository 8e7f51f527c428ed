"""What is true in a scene, read from the physics: where things are, how far the task is done, whether it is.

Success is judged by a travel, a depth, an opening or a hold of the things themselves. Nothing here knows the
selector's distances, gates or noisy poses.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hcpg.twin.bodies import Addresses
from hcpg.types import Float

PEG_DEPTH_M, PEG_PLAY_M = 0.025, 0.004
"""The peg's tip is this deep in the hole, and no further than this from its axis along x and y."""
BUTTON_TRAVEL_M, BUTTON_RANGE_M = 0.010, 0.012
DRAWER_OPENING_M = 0.008
BALL_LIFT_M = 0.05
LIFT_GOAL_M = 0.10
"""How far above its place the ball shall go."""
TICKS = {"peg-insertion": 3, "button-press": 1, "drawer-closing": 1, "rugby-grasp": 30}
"""How many ticks in a row the condition has to hold: a peg that bounces is not inserted, and a ball is held
for one second."""

WITH_THE_TIP = ("peg-insertion", "button-press")
"""Tasks done with the tip of the tool; in the others it is the TCP that has to be at the thing."""


class Truth(NamedTuple):
    """One moment of a scene."""

    object: Float[np.ndarray, " 3"]
    """What perception would find if it were perfect, m."""
    goal: Float[np.ndarray, " 3"]
    tip: Float[np.ndarray, " 3"]
    """Lower end of the peg, or of the fingers."""
    reach_m: float
    """From the tool to the thing: 0 once it is worked on."""
    progress: float
    """Part of the task that is done, 0 to 1."""
    holds: bool
    """Whether the task's condition holds in this moment."""
    done: bool
    """Whether it has held for as long as the task asks."""
    was_done: bool
    """Whether that was so at any tick since the episode began: a button comes up again once the arm holds."""


class Judge:
    """Watches one episode of a scene; ask it once per tick."""

    def __init__(self, task: str, model: Any, data: Any) -> None:
        self._task, self._model, self._data = task, model, data
        self._at, self._measure = Addresses.of(model), _MEASURES[task]
        self._pads = [model.geom(f"{side}_finger_pad").id for side in ("left", "right")]
        self.restart()

    def restart(self) -> None:
        """Begin an episode with things as they lie now; `first` is where the thing lies."""
        self._held_for, self._was_done = 0, False
        self.first = self._data.site_xpos[self._at.object].copy()
        self._opening_m = self._joint("drawer") if self._task == "drawer-closing" else 0.0

    def look(self) -> Truth:
        """What is true now, without counting a tick."""
        data = self._data
        thing, tip = data.site_xpos[self._at.object].copy(), data.site_xpos[self._at.tip].copy()
        progress, holds = self._measure(self, thing, tip)
        tool = tip if self._task in WITH_THE_TIP else data.site_xpos[self._at.tcp]
        reach_m = 0.0 if progress > 0 else float(np.linalg.norm(thing - tool))
        done = self._held_for >= TICKS[self._task]
        return Truth(thing, self._goal(), tip, reach_m, progress, holds, done, self._was_done or done)

    def tick(self) -> Truth:
        """What is true now, one tick after the last."""
        holds = self.look().holds
        self._held_for = self._held_for + 1 if holds else 0
        told = self.look()
        self._was_done = told.was_done
        return told

    def _goal(self) -> Float[np.ndarray, " 3"]:
        if self._task == "rugby-grasp":
            return self.first + np.array([0.0, 0.0, LIFT_GOAL_M])
        return self._data.site("goal").xpos.copy()

    def _joint(self, name: str) -> float:
        return float(self._data.joint(name).qpos[0])

    def _peg(self, mouth: Float[np.ndarray, " 3"], tip: Float[np.ndarray, " 3"]) -> tuple[float, bool]:
        depth = float(mouth[2] - tip[2]) if np.abs(mouth - tip)[:2].max() < PEG_PLAY_M else 0.0
        return _share(depth / PEG_DEPTH_M), depth >= PEG_DEPTH_M

    def _button(self, _: Float[np.ndarray, " 3"], __: Float[np.ndarray, " 3"]) -> tuple[float, bool]:
        travel = self._joint("button")
        return _share(travel / BUTTON_TRAVEL_M), travel >= BUTTON_TRAVEL_M

    def _drawer(self, _: Float[np.ndarray, " 3"], __: Float[np.ndarray, " 3"]) -> tuple[float, bool]:
        opening = self._joint("drawer")
        return _share(1.0 - opening / max(self._opening_m, 1e-6)), opening < DRAWER_OPENING_M

    def _ball(self, ball: Float[np.ndarray, " 3"], _: Float[np.ndarray, " 3"]) -> tuple[float, bool]:
        gripped, lift = self._gripped(), float(ball[2] - self.first[2])
        return gripped * (0.3 + 0.7 * _share(lift / BALL_LIFT_M)), gripped and lift >= BALL_LIFT_M

    def _gripped(self) -> bool:
        """Whether both finger pads touch the ball."""
        geoms = self._data.contact.geom[: self._data.ncon]
        touching = geoms[(geoms == self._model.geom("ball").id).any(axis=1)]
        return all((touching == pad).any() for pad in self._pads)


_MEASURES: dict[str, Callable[..., tuple[float, bool]]] = {
    "peg-insertion": Judge._peg,
    "button-press": Judge._button,
    "drawer-closing": Judge._drawer,
    "rugby-grasp": Judge._ball,
}


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
