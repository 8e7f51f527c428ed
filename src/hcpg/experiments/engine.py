"""Run what an experiment lacks: one `hcpg train` a core; several launches at once share the work."""

import fcntl
import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import NamedTuple

from hcpg.experiments.ledger import DONE, Entry, entries, identity
from hcpg.experiments.protocols import Cell
from hcpg.loops.stops import Stops
from hcpg.presets import differences

POLL_S = 0.5
STATES = {0: "finished", 3: "diverged"}
"""Exit codes of `hcpg train` after which nothing is left to do."""


class Job(NamedTuple):
    """A run under way in a process of its own."""

    cell: Cell
    process: subprocess.Popen[bytes]
    core: int
    claim: TextIOWrapper
    """Open and locked while the job runs: no other launch takes this cell."""
    log: Path
    began: float


class Ended(NamedTuple):
    """How a launch ended."""

    failed: list[Cell]
    signal: int | None
    """The signal that stopped it, if one did."""


def run(cells: list[Cell], results: Path, cores: list[int], say: Callable[[str], None]) -> Ended:
    """Train every cell that is not done, one on each of `cores` at a time.

    A finished run is never repeated, a stopped or failed one is resumed, and one that another launch is at is
    left to it. SIGINT or SIGTERM lets every run save, and ends.
    """
    (results / ".claims").mkdir(parents=True, exist_ok=True)
    waiting = [each for each in entries(cells, results) if each.state not in DONE]
    say(f"{len(cells) - len(waiting)} of {len(cells)} runs are done, {len(waiting)} are left")
    jobs: list[Job] = []
    failed: list[Cell] = []
    with Stops() as stops:
        told = 0
        while jobs or (waiting and not stops.count):
            free = [core for core in cores if core not in {job.core for job in jobs}]
            while free and waiting and not stops.count:
                job = _started(waiting.pop(0), results, free[0])
                if job is not None:
                    say(f"{label(job.cell)}: started on core {free.pop(0)}")
                    jobs.append(job)
            time.sleep(POLL_S)
            if told < stops.count:
                told = stops.count
                _stop(jobs, at_once=told > 1)
            for job in [job for job in jobs if job.process.poll() is not None]:
                jobs.remove(job)
                failed += _ended(job, say, stopping=told > 0)
    return Ended(failed, stops.first)


def label(cell: Cell) -> str:
    """A cell in a few words."""
    return f"{cell.settings.task} {cell.settings.preset} s{cell.seed}"


def command(entry: Entry, results: Path) -> list[str]:
    """The `hcpg` arguments that make or continue the entry's run."""
    chosen = entry.cell.settings
    if entry.folder is not None:
        return ["train", "--resume", str(entry.folder)]
    names = ["--task", chosen.task, "--preset", chosen.preset, "--budget", chosen.budget.name]
    places = ["--seeds", str(entry.cell.seed), "--out", str(results)]
    return ["train", *names, *places, *differences(chosen)]


def _started(entry: Entry, results: Path, core: int) -> Job | None:
    """The job, or None if another launch has the cell, or has done it meanwhile."""
    claim = _claimed(entry.cell, results)
    if claim is None:
        return None
    entry = entries([entry.cell], results)[0]
    if entry.state in (*DONE, "running"):
        claim.close()
        return None
    log = results / "logs" / f"{label(entry.cell).replace('/', '-').replace(' ', '_')}.txt"
    log.parent.mkdir(exist_ok=True)
    arguments = [sys.executable, "-m", "hcpg", *command(entry, results)]
    with log.open("ab") as file:
        process = subprocess.Popen(arguments, stdout=file, stderr=file, start_new_session=True)
    os.sched_setaffinity(process.pid, {core})  # its own processes inherit it
    return Job(entry.cell, process, core, claim, log, time.monotonic())


def _claimed(cell: Cell, results: Path) -> TextIOWrapper | None:
    digest = hashlib.sha256(repr(identity(cell)).encode()).hexdigest()
    file = (results / ".claims" / digest).open("a")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        return None
    return file


def _stop(jobs: list[Job], *, at_once: bool) -> None:
    for job in jobs:
        if at_once:
            os.killpg(job.process.pid, signal.SIGKILL)
        else:
            job.process.send_signal(signal.SIGTERM)


def _ended(job: Job, say: Callable[[str], None], *, stopping: bool) -> list[Cell]:
    """Say how the job ended; gives its cell if it failed."""
    job.claim.close()
    code, minutes = job.process.returncode, (time.monotonic() - job.began) / 60
    sound = code in STATES or stopping
    state = STATES.get(code, "saved" if stopping else f"failed with exit code {code}")
    say(f"{label(job.cell)}: {state} after {minutes:.1f} minutes{'' if sound else f', see {job.log}'}")
    return [] if sound else [job.cell]
