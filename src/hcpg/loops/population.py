"""Train jobs in child processes: start them, pass on their news, stop them, say how each run ended."""

import multiprocessing
import os
import secrets
import signal
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

from hcpg.loops import machine
from hcpg.loops.child import STOP, Job, Message, log_of, work
from hcpg.loops.runs import RunFolder
from hcpg.loops.stops import Stops, deaf_start

HEARTBEAT_S = 0.25
LOG_LINES = 8
"""Lines of a dead process's log that its report quotes."""
_ENDS = ("finished", "stopped", "diverged", "failed")


class Lane(NamedTuple):
    """Which run news is about."""

    task: str
    preset: str
    seed: int
    steps: int
    """Environment steps of the whole run."""


@runtime_checkable
class View(Protocol):
    """Whoever shows the news to the user."""

    def tell(self, lane: Lane, message: Message) -> None:
        """News of one run."""
        ...

    def say(self, text: str) -> None:
        """A word about the whole command."""
        ...

    def beat(self) -> None:
        """Time has passed."""
        ...


@dataclass
class Outcome:
    """How one run ended."""

    lane: Lane
    state: str = "failed"
    """`finished`, `stopped`, `diverged` or `failed`."""
    folder: Path | None = None
    """None if the run failed before it had one."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What came with the end: `step`; `quantity` of a divergence; `error` of a failure."""


class Ended(NamedTuple):
    """How a command's runs ended."""

    outcomes: list[Outcome]
    signal: int | None
    """The signal that stopped them, if one did."""


def spread(jobs: Iterable[Job], accelerated: bool) -> list[Job]:
    """The jobs as they are laid onto processes: on a CPU one run each."""
    if accelerated:
        return list(jobs)
    return [
        job._replace(seeds=[seed], folders=job.folders[index : index + 1])
        for job in jobs
        for index, seed in enumerate(job.seeds)
    ]


def train(jobs: list[Job], view: View, accelerated: bool) -> Ended:
    """Train all jobs side by side until every run has ended; one that fails does not disturb the others.

    The first SIGINT, SIGTERM or SIGHUP lets every run finish its step and save; the second kills.
    """
    placed = spread(jobs, accelerated)
    with Stops() as stops:
        children = [_Child(job, index, len(placed), accelerated) for index, job in enumerate(placed)]
        told = False
        while any(child.pipe for child in children):
            ready = wait([child.pipe for child in children if child.pipe], HEARTBEAT_S)
            for child in children:
                if child.pipe in ready:
                    child.listen(view)
            if stops.count and not told:
                told = True
                view.say("stopping: every run finishes its step and saves; once more kills at once")
                for child in children:
                    child.ask_to_stop()
            if stops.count > 1:
                for child in children:
                    child.process.kill()
            view.beat()
    return Ended([outcome for child in children for outcome in child.outcomes.values()], stops.first)


class _Child:
    """The parent's side of one process."""

    def __init__(self, job: Job, index: int, processes: int, accelerated: bool) -> None:
        self.outcomes = {seed: Outcome(lane_of(job.config, seed)) for seed in job.seeds}
        for seed, folder in zip(job.seeds, job.folders, strict=bool(job.folders)):
            self.outcomes[seed].folder = folder
        new_log = job.root / f".log-{secrets.token_hex(4)}.txt"
        self._log = log_of(job.folders[0]) if job.folders else new_log
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        self.pipe: Connection | None = here
        arguments = (job, machine.cores_each(processes), self._log, there)
        self.process: BaseProcess = context.Process(target=work, args=arguments)
        share = machine.gpu_share if accelerated else machine.one_core
        with deaf_start(share(os.environ, processes)):
            self.process.start()
        core = None if accelerated else machine.core_for(index, processes)
        if core is not None and self.process.pid is not None:
            with suppress(ProcessLookupError):  # it has died already; `listen` will notice
                os.sched_setaffinity(self.process.pid, core)  # its workers inherit it
        there.close()  # the child holds the only other end: its death reads as the end of the pipe

    def listen(self, view: View) -> None:
        """Take one message, or note that the process is gone."""
        assert self.pipe is not None
        try:
            message = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self._bury(view)
            return
        self._note(message)
        view.tell(self.outcomes[message.seed].lane, message)

    def ask_to_stop(self) -> None:
        """Let every run of the process finish its step and save."""
        if self.pipe is None:
            return
        with suppress(BrokenPipeError, ConnectionResetError):  # it has just ended; `listen` will notice
            self.pipe.send(STOP)

    def _note(self, message: Message) -> None:
        outcome = self.outcomes[message.seed]
        if message.kind == "opened":
            outcome.folder = Path(message.facts["folder"])
            self._log = log_of(next(each.folder for each in self.outcomes.values() if each.folder))
        if message.kind in _ENDS:
            outcome.state, outcome.facts = message.kind, message.facts

    def _bury(self, view: View) -> None:
        assert self.pipe is not None
        self.pipe.close()
        self.pipe = None
        self.process.join()
        for seed, outcome in self.outcomes.items():
            if not outcome.facts:
                message = Message("failed", seed, {"error": self._cause_of_death()})
                self._note(message)
                view.tell(outcome.lane, message)
                if outcome.folder is not None:
                    RunFolder.open(outcome.folder).set_status("failed", **message.facts)

    def _cause_of_death(self) -> str:
        code = self.process.exitcode or 0
        how = f"signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"exit code {code}"
        lines = self._log.read_text(errors="replace").splitlines()[-LOG_LINES:] if self._log.exists() else []
        return "\n  ".join([f"its process died with {how}; the end of {self._log}:", *lines])


def lane_of(config: Mapping[str, Any], seed: int) -> Lane:
    """The lane of the run with that configuration and seed."""
    return Lane(config["task"], config["preset"], seed, config["budget"]["steps"])
