"""A thread that reads, so that nobody else ever waits: the newest value is always at hand."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Newest(Generic[Value]):
    """Calls a blocking `read` over and over in a thread of its own and keeps what came last.

    The first read is made by the caller's thread, so there is a value from the beginning. A read that raises
    ends the thread; `error` has it, and the last value stays.
    """

    def __init__(self, read: Callable[[], Value], name: str) -> None:
        """`read` sets the pace: it returns when there is something new. `name` is the thread's."""
        self._read = read
        self._value = read()
        self._ends = threading.Event()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._follow, name=name, daemon=True)
        self._thread.start()

    @property
    def value(self) -> Value:
        """What was read last; at once."""
        return self._value

    @property
    def error(self) -> Exception | None:
        """What ended the reading; None while it goes on."""
        return self._error

    def close(self, timeout_s: float) -> bool:
        """End the thread after its running read; gives whether it ended in time. Safe to call twice."""
        self._ends.set()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _follow(self) -> None:
        while not self._ends.is_set():
            try:
                self._value = self._read()
            except Exception as error:  # a thread has nobody above it: whoever looks at `error` decides
                self._error = error
                return
