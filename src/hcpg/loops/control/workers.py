"""Who computes while the loop keeps its deadlines: one call at a time, each under a ticket."""

import threading
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, runtime_checkable

from hcpg.interfaces import Clock
from hcpg.safety.clock import MachineClock


class Answer(NamedTuple):
    """What a call gave."""

    value: Any
    error: Exception | None
    """What it raised; `value` is None then."""
    took_s: float


@runtime_checkable
class Worker(Protocol):
    """Makes one call at a time. An answer is had under its own ticket only, so an old one is never read."""

    def ask(self, ticket: int, call: Callable[[], Any]) -> bool:
        """Have `call` made; False while an earlier one still runs (nothing is queued)."""
        ...

    def answer(self, ticket: int, until_s: float) -> Answer | None:
        """The answer to `ticket`, waited for until `until_s` at the longest; None if it came later."""
        ...

    def close(self) -> None:
        """Take no more calls; safe to call twice."""
        ...


def _made(call: Callable[[], Any], clock: Clock) -> Answer:
    start_s = clock.now_s()
    try:
        value, error = call(), None
    except Exception as raised:  # whoever reads the answer decides
        value, error = None, raised
    return Answer(value, error, clock.now_s() - start_s)


class InlineWorker:
    """Makes the call at once, in the caller's thread; for clocks that stand still meanwhile."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._ticket, self._answer = -1, Answer(None, None, 0.0)

    def ask(self, ticket: int, call: Callable[[], Any]) -> bool:
        """Make the call now; always True."""
        self._ticket, self._answer = ticket, _made(call, self._clock)
        return True

    def answer(self, ticket: int, until_s: float) -> Answer | None:
        """The answer, unless the clock went past `until_s` while it was made."""
        late = self._clock.now_s() > until_s
        return None if late or ticket != self._ticket else self._answer

    def close(self) -> None:
        """Nothing to end."""


class ThreadWorker:
    """Makes the calls in a thread of its own, so a call that hangs costs ticks but never the loop."""

    def __init__(self, clock: Clock, name: str) -> None:
        self._clock = clock
        self._changed = threading.Condition()
        self._call: tuple[int, Callable[[], Any]] | None = None
        self._done: tuple[int, Answer] | None = None
        self._closed = False
        threading.Thread(target=self._serve, name=name, daemon=True).start()

    def ask(self, ticket: int, call: Callable[[], Any]) -> bool:
        """Hand the call over; False while an earlier one still runs, or after `close`."""
        with self._changed:
            if self._call is not None or self._closed:
                return False
            self._call = (ticket, call)
            self._changed.notify_all()
            return True

    def answer(self, ticket: int, until_s: float) -> Answer | None:
        """The answer, as soon as it is there."""
        with self._changed:
            left_s = max(until_s - self._clock.now_s(), 0.0)
            self._changed.wait_for(lambda: self._done is not None and self._done[0] == ticket, left_s)
            return self._done[1] if self._done is not None and self._done[0] == ticket else None

    def close(self) -> None:
        """End the thread after the running call; it is not waited for."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._call is not None or self._closed)
                if self._call is None:
                    return
                ticket, call = self._call
            answer = _made(call, self._clock)
            with self._changed:
                self._call, self._done = None, (ticket, answer)
                self._changed.notify_all()


def passes_by_itself(clock: Clock) -> bool:
    """Whether time goes on while somebody computes; a simulation's stands still meanwhile."""
    return isinstance(clock, MachineClock)


def worker_for(clock: Clock, name: str) -> Worker:
    """A thread where time passes by itself; else the caller's own thread."""
    return ThreadWorker(clock, name) if passes_by_itself(clock) else InlineWorker(clock)
