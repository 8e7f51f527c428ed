"""Who lays out the scene and says whether the task is done: a person at a terminal, or nobody.

The person never learns which policy acts: only the trial's code is shown.
"""

import os
import select
import sys
from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

POLL_S = 0.1
LINE_BYTES = 4096
READY = "{trial}: lay out start state {start} and step back. Scene ready? [Enter] "
LAID_OUT = "{trial}: the scene is laid out. Scene ready? [Enter] "
DONE = "{trial}: is the task done? [y, n, or i: the trial is invalid] "
REASON = "{trial}: why is it invalid? "


class NobodyThereError(RuntimeError):
    """The input ended where a person has to answer: a fault, since nobody watches the arm."""


class Opinion(NamedTuple):
    """What a person says of a trial that ended."""

    done: bool | None
    """None where the trial is invalid, or the question was cut short."""
    invalid: str
    """Why it does not count; "" where it does."""


@runtime_checkable
class Operator(Protocol):
    """Whoever stands beside the arm."""

    @property
    def judges(self) -> bool:
        """Whether it says of every trial whether the task is done."""
        ...

    def ready(self, trial: str, start: int, stopped: Callable[[], str]) -> bool:
        """Wait until the scene is ready; False once `stopped` gives a reason.

        Raises:
            NobodyThereError: nobody can answer any more.
        """
        ...

    def opinion(self, trial: str) -> Opinion:
        """Whether the task is done.

        Raises:
            NobodyThereError: nobody can answer any more.
        """
        ...


class Nobody:
    """For an arm whose scene lays itself out."""

    judges = False

    def ready(self, trial: str, start: int, stopped: Callable[[], str]) -> bool:
        """At once."""
        return not stopped()

    def opinion(self, trial: str) -> Opinion:
        """None."""
        return Opinion(None, "")


class Console:
    """A person at a terminal. Before every question, what was typed ahead is thrown away."""

    judges = True

    def __init__(self, lays_out: bool, input_number: int = 0) -> None:
        """`lays_out` tells whether the person does it; `input_number` is the file descriptor to read."""
        self._ready = READY if lays_out else LAID_OUT
        self._input, self._waiting = input_number, b""

    def ready(self, trial: str, start: int, stopped: Callable[[], str]) -> bool:
        """Wait for Enter."""
        return self._asked(self._ready.format(trial=trial, start=start), stopped) is not None

    def opinion(self, trial: str) -> Opinion:
        """Ask until the answer is one of the three."""
        answers = {"y": Opinion(True, ""), "n": Opinion(False, "")}
        while True:
            answer = self._asked(DONE.format(trial=trial), _never)
            if answer in answers:
                return answers[answer]
            if answer == "i":
                reason = self._asked(REASON.format(trial=trial), _never)
                return Opinion(None, f"the operator: {reason or 'no reason given'}")

    def _asked(self, question: str, stopped: Callable[[], str]) -> str | None:
        """The next line that is typed after the question, in small letters; None once `stopped`."""
        self._drain()
        sys.stdout.write(question)
        sys.stdout.flush()
        while b"\n" not in self._waiting:
            if stopped():
                return None
            if self._has_input(POLL_S):
                self._read()
        line, _, self._waiting = self._waiting.partition(b"\n")
        return line.decode(errors="replace").strip().lower()

    def _drain(self) -> None:
        """A key that was pressed before the question is no answer to it."""
        while self._has_input(0.0):
            self._read()
        self._waiting = b""

    def _has_input(self, timeout_s: float) -> bool:
        return bool(select.select([self._input], [], [], timeout_s)[0])

    def _read(self) -> None:
        content = os.read(self._input, LINE_BYTES)
        if not content:
            raise NobodyThereError("the input ended, so nobody watches the arm; run it at a terminal")
        self._waiting += content


def _never() -> str:
    return ""
