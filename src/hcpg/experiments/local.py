"""One machine as a place for jobs: each is an `hcpg train` process that keeps to its slot."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from io import TextIOWrapper
from pathlib import Path
from typing import NamedTuple

from hcpg.experiments.slots import Slot
from hcpg.experiments.units import Unit, command


class ThisMachine:
    """Slots of this machine; a core on which another launch has a job is not free."""

    def __init__(self, slots: list[Slot], *, together: bool) -> None:
        self.together = together
        self._slots = slots
        self._taken: tuple[Slot, TextIOWrapper] | None = None

    def room(self) -> bool:
        """Whether a job can be started; its slot is then kept for it."""
        for slot in self._slots:
            if self._taken is None and (lock := slot.take()) is not None:
                self._taken = slot, lock
        return self._taken is not None

    def start(self, unit: Unit, results: Path, claims: list[TextIOWrapper]) -> "LocalJob":
        """Train the unit in the slot that `room` found."""
        assert self._taken is not None
        (slot, lock), self._taken = self._taken, None
        # With the locks in its hands the job keeps its cells and its core, should this process be killed.
        process = training(command(unit, results), results / unit.log, slot, keep=[lock, *claims])
        return LocalJob(process, slot.name, lock)

    def close(self) -> None:
        """Let go of a slot that no job came for."""
        if self._taken is not None:
            self._taken[1].close()


class LocalJob(NamedTuple):
    """A unit in training on this machine."""

    process: subprocess.Popen[bytes]
    place: str
    lock: TextIOWrapper

    def poll(self) -> int | None:
        """The exit code; None while it runs."""
        code = self.process.poll()
        if code is not None:
            self.lock.close()
        return code

    def stop(self, *, at_once: bool) -> None:
        """Let it save and end, or kill it."""
        stop(self.process, at_once=at_once)


def training(
    words: list[str],
    log: Path,
    slot: Slot,
    *,
    keep: Iterable[TextIOWrapper],
    folder: Path | None = None,
    leash: bool = False,
) -> subprocess.Popen[bytes]:
    """`hcpg` as a process of its own.

    Args:
        words: its arguments.
        log: a file, made if need be, to which its output is added.
        slot: the cores it keeps to (none: any), and its environment variables beside those of this process.
        keep: files that it holds open, for their locks.
        folder: its working folder; default: this process's.
        leash: it is told to save and end when this process dies.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    module = ["hcpg.experiments.leash", str(os.getpid())] if leash else ["hcpg"]
    with log.open("ab") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", *module, *words],
            cwd=folder,
            stdout=file,
            stderr=file,
            env={**os.environ, **slot.variables},
            start_new_session=True,
            pass_fds=[each.fileno() for each in keep],
        )
    if slot.cores:
        os.sched_setaffinity(process.pid, slot.cores)  # its own processes inherit it
    return process


def stop(process: subprocess.Popen[bytes], *, at_once: bool) -> None:
    """Let a training process save and end, or kill it with its own ones."""
    if at_once:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.send_signal(signal.SIGTERM)
