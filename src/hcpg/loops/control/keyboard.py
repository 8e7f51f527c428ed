"""A person at the keyboard of a terminal moves the arm: a key that is held pushes along one axis."""

import os
import select
import termios
import tty
from collections.abc import Mapping
from typing import Any

import numpy as np

from hcpg.interfaces import Clock
from hcpg.types import Float

AXES: Mapping[str, tuple[int, float]] = {
    "w": (0, 1.0), "s": (0, -1.0), "a": (1, 1.0), "d": (1, -1.0), "r": (2, 1.0), "f": (2, -1.0),
}  # fmt: skip
"""Key -> axis of the base frame, and direction: away and back, left and right, up and down."""
GRIPS: Mapping[str, float] = {"o": 1.0, "c": -1.0}
"""Open and close; the word stands until the other one."""
HELP = "w/s away and back, a/d left and right, r/f up and down, o/c open and close, Ctrl-C stops"
HELD_S = 0.15
"""A press pushes for so long; a terminal repeats a held key every 30 to 50 ms."""
_CHUNK = 64


class DeviceError(RuntimeError):
    """A device that a person cannot move the arm with; the message says why and the cure."""


class Keyboard:
    """Proposals from the keys pressed last; used as a block, which puts the terminal back as it was."""

    def __init__(self, descriptor: int, clock: Clock, action_size: int, speed: float = 1.0) -> None:
        """`speed` in (0, 1] is the part of a full step that a held key asks for; `clock` is real time.

        Raises:
            DeviceError: the descriptor is no terminal.
        """
        if not os.isatty(descriptor):
            raise DeviceError(
                "the keyboard needs a terminal, and standard input is none (a pipe, a file, or closed). "
                "Run the command in a terminal, or take another --source."
            )
        self._descriptor, self._clock, self._size, self._speed = descriptor, clock, action_size, speed
        self._pressed_s: dict[str, float] = {}
        self._grip = 0.0
        self._before: list[Any] = []

    def __enter__(self) -> "Keyboard":
        self._before = termios.tcgetattr(self._descriptor)
        tty.setcbreak(self._descriptor, termios.TCSANOW)
        return self

    def __exit__(self, *_: object) -> None:
        termios.tcsetattr(self._descriptor, termios.TCSANOW, self._before)

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """What the keys ask for now, `count` times; never waits.

        Raises:
            DeviceError: the terminal is gone.
        """
        self._read()
        now_s, action = self._clock.now_s(), np.zeros(self._size)
        for key, (axis, direction) in AXES.items():
            if now_s - self._pressed_s.get(key, -np.inf) < HELD_S:
                action[axis] += self._speed * direction
        action[3:] = self._grip
        return np.tile(action, (count, 1))

    def _read(self) -> None:
        while select.select([self._descriptor], [], [], 0.0)[0]:
            for key in self._typed():
                self._pressed_s[key] = self._clock.now_s()
                self._grip = GRIPS.get(key, self._grip)

    def _typed(self) -> str:
        gone = "the terminal is at its end (EOF): nobody can move the arm any more"
        try:
            typed = os.read(self._descriptor, _CHUNK)
        except OSError as error:
            raise DeviceError(gone) from error
        if not typed:
            raise DeviceError(gone)
        return typed.decode(errors="ignore").lower()
