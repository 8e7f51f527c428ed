"""The stop button: pressed by a signal, another thread or the loop itself, once or many times."""

import signal
import threading
from types import FrameType
from typing import Any

from hcpg.interfaces import Robot
from hcpg.loops.stops import STOPPING


class StopButton:
    """Stops the robot at once and lets the loop know why. Used as a block, signals press it.

    Nothing here takes a lock, so a signal may interrupt anything.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._before: dict[int, Any] = {}
        self.reason = ""
        """The first reason it was pressed for; "" until then."""
        self.signal: int | None = None
        """The first signal's number; it decides the exit code."""

    def press(self, reason: str) -> None:
        """Stop the robot, now; safe from any thread and signal handler, any number of times."""
        self.reason = self.reason or reason
        self._robot.stop(self.reason)

    def __enter__(self) -> "StopButton":
        if threading.current_thread() is threading.main_thread():
            for number in STOPPING:
                if signal.getsignal(number) is not signal.SIG_IGN:  # `nohup` ignores SIGHUP: let it
                    self._before[number] = signal.signal(number, self._pressed_by)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _pressed_by(self, number: int, _: FrameType | None) -> None:
        self.signal = self.signal or number
        self.press(f"signal {signal.Signals(number).name}")
