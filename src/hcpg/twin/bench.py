"""The table of a scene, whoever moves the arm: what lies where, when it is laid out, what is true of it."""

from typing import Any

import numpy as np

from hcpg.twin.bodies import Addresses, arrange
from hcpg.twin.judging import Judge, Truth
from hcpg.twin.scenes import Layout, Point, layout, scene
from hcpg.types import Float

CLEAR_M = 0.03
"""The arm is clear of the things when it is no more than this below its home."""
Places = dict[str, Float[np.ndarray, " 3"]]


class Bench:
    """Things on a table, in a simulation that somebody else steps; only that one may call it."""

    def __init__(self, task: str, seed: int, model: Any, data: Any) -> None:
        """Start states are the set that `seed` names."""
        self.scene, self._seed = scene(task), seed
        self._model, self._data, self._at = model, data, Addresses.of(model)
        self._judge = Judge(task, model, data)
        self._layout, self._pending = self.layout(0), None

    def layout(self, start: int) -> Layout:
        """Start state `start`."""
        return layout(self.scene, self._seed, start)

    def ask_for(self, start: int) -> None:
        """Lay out start state `start` at the first tick at which the arm is clear of the things."""
        self._pending = self.layout(start)

    def begin(self, laid_out: Layout) -> None:
        """Begin an episode with things that lie as `laid_out` says already."""
        self._layout, self._pending = laid_out, None
        self._judge.restart()

    def tick(self) -> bool:
        """One thirtieth of a second later: lay out or judge; gives whether things were laid out."""
        if self._pending is None or not clear(self._data.site_xpos[self._at.tcp], self.scene.home):
            self._judge.tick()
            return False
        arrange(self._model, self._data, self._pending)
        return True

    def begin_pending(self) -> None:
        """Begin the episode that `tick` laid out, once positions have been worked out anew."""
        if self._pending is not None:
            self.begin(self._pending)

    @property
    def waiting(self) -> bool:
        """Whether a layout is asked for that is not there yet."""
        return self._pending is not None

    def truth(self) -> Truth:
        """What is true now."""
        return self._judge.look()

    def surveyed(self) -> Places:
        """Where the thing that does not move was touched off, m, by its name; empty where none is needed."""
        if not self.scene.fixed:
            return {}
        place = self._judge.look().goal if self.scene.moving else self._judge.first
        return {self.scene.fixed: place + self._layout.survey}

    def moving(self) -> Places:
        """Where the thing that a camera follows is now, m, by its name; empty where nothing moves."""
        return {self.scene.moving: self._judge.look().object} if self.scene.moving else {}


def clear(position: Float[np.ndarray, " 3"], home: Point) -> bool:
    """Whether a TCP position is high enough for things to be laid out under it."""
    return bool(position[2] > home[2] - CLEAR_M)
