"""A served twin that is killed, frozen and started again: what a drill of faults needs."""

import signal
import threading
from contextlib import ExitStack
from pathlib import Path

from hcpg.robot_types import RobotError
from hcpg.twin.launching import Served, served

STARTED_S = 40.0


class KeptTwin:
    """A twin of one task at one address; what it says goes into one log."""

    def __init__(self, task: str, address: str, seed: int, log: Path) -> None:
        """Nothing runs before `ensure`."""
        self._where = (task, address, seed, log)
        self._stack, self._served = ExitStack(), None
        self._starting: threading.Thread | None = None
        self._thaw: threading.Timer | None = None

    def ensure(self) -> None:
        """Have one that runs: the same as before, or a new one.

        Raises:
            RobotError: it does not start.
        """
        self._settle()
        if self._served is None or self._served.process.poll() is not None:
            self._start()

    def kill(self) -> None:
        """End it at once, without a word."""
        process = self._running().process
        process.kill()
        process.wait()

    def start_in(self, seconds: float) -> None:
        """Start a new one that much later, without waiting for it."""
        self._starting = threading.Timer(seconds, self._start)
        self._starting.start()

    def freeze(self, seconds: float) -> None:
        """Stop all its threads for so long, without waiting for the end."""
        process = self._running().process
        process.send_signal(signal.SIGSTOP)
        self._thaw = threading.Timer(seconds, process.send_signal, [signal.SIGCONT])
        self._thaw.start()

    def close(self) -> None:
        """End whatever runs; safe to call twice."""
        self._settle()
        self._stack.close()
        self._served = None

    def _running(self) -> Served:
        if self._served is None:
            raise RobotError("no twin runs; call `ensure` first")
        return self._served

    def _settle(self) -> None:
        """Wait for what was begun and not waited for."""
        for pending in (self._starting, self._thaw):
            if pending is not None:
                pending.join(STARTED_S)
        self._starting = self._thaw = None

    def _start(self) -> None:
        self._stack.close()
        self._served = self._stack.enter_context(served(*self._where))
