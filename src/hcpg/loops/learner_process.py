"""The learner in a process of its own: episodes go in, word of the next checkpoint comes out."""

import multiprocessing
import os
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.loops import machine
from hcpg.loops.child import as_text, redirect_output
from hcpg.loops.compiled_programs import open_programs
from hcpg.loops.control.experience import Experience
from hcpg.loops.stops import deaf_start, obey_parent

NICENESS = 5
"""The learner comes after the arm's process."""
_LOOK_S = 0.1


class LearnerError(RuntimeError):
    """A learner that ended; the message says why, or where its output is."""


class Word(NamedTuple):
    """What the learner tells: that it is ready, or has taken in an episode."""

    progress: Any
    """`online_learner.Progress`."""
    row: dict[str, Any]
    """The metrics of the episode; nothing at the start."""


class LearnerProcess:
    """The parent's side. Between two episodes the learner has nothing to do but what it was just given."""

    def __init__(self, run: Path, shown: Path, task: str, log: Path) -> None:
        """Start it; `log` takes its output."""
        self._log, self._failure, self._owes = log, "", 1
        context = multiprocessing.get_context("spawn")
        self._pipe, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(run, shown, task, log, there))
        with deaf_start(machine.one_core(os.environ)):
            self._process.start()
        there.close()

    def alive(self) -> bool:
        """Whether it still learns."""
        return not self._failure and self._process.is_alive()

    def give(self, episode: Experience) -> None:
        """Hand an episode over; a learner that has died takes nothing."""
        self._owes += 1
        with suppress(BrokenPipeError, ConnectionResetError):  # `word` will notice
            self._pipe.send(episode)

    def word(self, stop: Callable[[], bool]) -> Word | None:
        """What it tells next, waited for until `stop` says so; None then, or if nothing is owed.

        Raises:
            LearnerError: it ended.
        """
        while self._owes and not stop():
            if not self._pipe.poll(_LOOK_S):
                continue
            try:
                told = self._pipe.recv()
            except (EOFError, ConnectionResetError):
                told = f"its process died; the end of its output is in {self._log}"
            if isinstance(told, str):
                self._failure = told
                raise LearnerError(f"the learner ended: {told}")
            self._owes -= 1
            return told
        return None

    def close(self) -> None:
        """Let it finish what it was given, and end; safe to call twice."""
        self._pipe.close()  # what was sent is still read; the end of the pipe comes after it
        self._process.join()


def _serve(run: Path, shown: Path, task: str, log: Path, pipe: Connection) -> None:
    """The body of the process: learn from what arrives until the parent hangs up, or is gone."""
    redirect_output(log)
    _step_back()
    programs = open_programs(os.environ)
    obey_parent(lambda: None)  # whatever was executed shall be learned from: the end of the pipe ends it
    try:
        _learn(run, shown, task, pipe)
    except Exception as error:  # whatever it is, the parent reports it; the traceback stays in the log
        traceback.print_exc()
        with suppress(BrokenPipeError, ConnectionResetError):
            pipe.send(as_text(error))
        sys.exit(1)
    finally:
        if programs is not None:
            programs.close()


def _learn(run: Path, shown: Path, task: str, pipe: Connection) -> None:
    from hcpg.loops.demonstrations import load
    from hcpg.loops.online_learner import OnlineLearner
    from hcpg.loops.runs import RunFolder

    learner = OnlineLearner(RunFolder.open(run), load(shown, task))
    with suppress(BrokenPipeError, ConnectionResetError):  # nobody listens any more; what was sent is learned
        pipe.send(Word(learner.progress, {}))
    while True:
        try:
            episode = pipe.recv()
        except (EOFError, ConnectionResetError):
            return
        progress = learner.take_in(episode)
        with suppress(BrokenPipeError, ConnectionResetError):
            pipe.send(Word(progress, learner.told[-1]))


def _step_back() -> None:
    """Ordinary, low priority, whatever the arm's process has."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.nice(NICENESS)
