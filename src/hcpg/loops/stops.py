"""Signals that ask a command to stop: counted, not died of, and kept from processes just starting."""

import os
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stops:
    """Counts the signals that arrive while its block runs."""

    def __init__(self) -> None:
        self.count = 0
        self.first: int | None = None
        """The first one's number."""
        self._before: dict[int, Any] = {}

    def __enter__(self) -> "Stops":
        for number in STOPPING:
            if signal.getsignal(number) is not signal.SIG_IGN:  # `nohup` ignores SIGHUP: let it
                self._before[number] = signal.signal(number, self._count)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _count(self, number: int, _: FrameType | None) -> None:
        self.count += 1
        self.first = self.first or number


@contextmanager
def deaf_start(variables: Mapping[str, str]) -> Iterator[None]:
    """What a process started in the block gets: these variables, and no ear for signals until it is ready."""
    before = {name: os.environ.get(name) for name in variables}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def obey_parent(stop: Callable[[], None]) -> None:
    """In the started process: SIGTERM calls `stop`, and the terminal's signals are the parent's to judge."""
    signal.signal(signal.SIGTERM, lambda *_: stop())
    for number in (signal.SIGINT, signal.SIGHUP):  # the terminal sends these to the whole group
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
