"""Run what an experiment lacks, job by job, wherever there is room; launches at once share the work."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from io import TextIOWrapper
from pathlib import Path
from typing import NamedTuple, Protocol, runtime_checkable

from hcpg.experiments.claims import claim_of, locked
from hcpg.experiments.ledger import DONE, entries, recorded
from hcpg.experiments.protocols import Cell
from hcpg.experiments.units import Unit, units
from hcpg.loops.stops import Stops

POLL_S = 0.5
STATES = {0: "finished", 3: "diverged"}
"""Exit codes of `hcpg train` after which nothing is left to do."""
LOST = 256
"""In place of an exit code, which are smaller: the job is gone with its machine."""
MOST_LOSSES = 3
"""Machines that a unit may lose before it counts as failed: it may be what kills them."""


@runtime_checkable
class Job(Protocol):
    """A unit in training."""

    @property
    def place(self) -> str:
        """Where it runs, in a word or two."""
        ...

    def poll(self) -> int | None:
        """The exit code, or `LOST`; None while it runs."""
        ...

    def stop(self, *, at_once: bool) -> None:
        """Let it save and end, or kill it."""
        ...


@runtime_checkable
class Place(Protocol):
    """What jobs run on."""

    together: bool
    """Whether the seeds of a configuration make one job."""

    def room(self) -> bool:
        """Whether one more job can be started."""
        ...

    def start(self, unit: Unit, results: Path, claims: list[TextIOWrapper]) -> Job:
        """Train the unit; there is room. The job holds the claims, too, if it can outlive this process."""
        ...

    def close(self) -> None:
        """Let go of it; jobs that cannot outlive this process end."""
        ...


class Ended(NamedTuple):
    """How a launch ended."""

    failed: list[Cell]
    signal: int | None
    """The signal that stopped it, if one did."""


def run(cells: list[Cell], results: Path, place: Place, say: Callable[[str], None]) -> Ended:
    """Train every cell that is not done.

    A finished run is never repeated, a stopped, failed or lost one is resumed from its last checkpoint, and
    one that another launch is at is left to it. SIGINT or SIGTERM lets every run save, and ends.
    """
    waiting = [each for each in entries(cells, results) if each.state not in DONE]
    say(f"{len(cells) - len(waiting)} of {len(cells)} runs are done, {len(waiting)} are left")
    launch = _Launch(results, place, say, [unit.cells for unit in units(waiting, place.together)])
    with Stops() as stops:
        told = 0
        while launch.running or (launch.waiting and not stops.count):
            if not stops.count:
                launch.fill()
            time.sleep(POLL_S)
            if told < stops.count:
                told = stops.count
                launch.stop(at_once=told > 1)
            launch.collect()
    return Ended(launch.failed, stops.first)


class _Running(NamedTuple):
    unit: Unit
    job: Job
    claims: list[TextIOWrapper]
    began: float


@dataclass
class _Launch:
    """What is still to do, what runs, and what failed."""

    results: Path
    place: Place
    say: Callable[[str], None]
    waiting: list[list[Cell]]
    running: list[_Running] = field(default_factory=list)
    failed: list[Cell] = field(default_factory=list)
    _losses: Counter[tuple[str, int]] = field(default_factory=Counter)
    _stopping: bool = False
    _waits: bool = False

    def fill(self) -> None:
        """Start jobs while there is room."""
        while self.waiting and self.place.room():
            self._start(self.waiting.pop(0))
        idle = bool(self.waiting) and not self.running
        if idle and not self._waits:
            self.say("no room at present; waiting for a place to get free")
        self._waits = idle

    def stop(self, *, at_once: bool) -> None:
        """Let every job save and end, or kill them."""
        self._stopping = True
        for each in self.running:
            each.job.stop(at_once=at_once)

    def collect(self) -> None:
        """Take leave of the jobs that have ended."""
        for each in list(self.running):
            code = each.job.poll()
            if code is not None:
                self.running.remove(each)
                for claim in each.claims:
                    claim.close()
                self._note_end(each, code)

    def _start(self, cells: list[Cell]) -> None:
        """Train what is left of the cells once they are claimed; another launch may have come first."""
        tried = {cell.identity(): locked(claim_of(cell, self.results)) for cell in cells}
        claims = {identity: claim for identity, claim in tried.items() if claim is not None}
        mine = [cell for cell in cells if cell.identity() in claims]
        left = [each for each in recorded(mine, self.results) if each.state not in (*DONE, "running")]
        found = units(left, self.place.together)
        self.waiting[:0] = [unit.cells for unit in found[1:]]
        held = [claims.pop(cell.identity()) for unit in found[:1] for cell in unit.cells]
        for claim in claims.values():
            claim.close()
        for unit in found[:1]:
            job = self.place.start(unit, self.results, held)
            self.say(f"{unit.label}: started on {job.place}")
            self.running.append(_Running(unit, job, held, time.monotonic()))

    def _note_end(self, ended: _Running, code: int) -> None:
        unit, minutes = ended.unit, (time.monotonic() - ended.began) / 60
        goes_on = code == LOST and not self._stopping and self._may_go_on(unit)
        sound = code in STATES or goes_on or self._stopping
        word = STATES.get(code, "saved" if self._stopping else f"failed with exit code {code}")
        if code == LOST:
            word = f"lost with {ended.job.place}" + (", goes on elsewhere" if goes_on else "")
        end = "" if sound else f", see {self.results / unit.log}"
        self.say(f"{unit.label}: {word} after {minutes:.1f} minutes{end}")
        if goes_on:
            self.waiting.insert(0, unit.cells)
        if not sound:
            self.failed += unit.cells

    def _may_go_on(self, unit: Unit) -> bool:
        """Note a loss; whether the unit's runs have not been lost too often."""
        self._losses.update(cell.identity() for cell in unit.cells)
        return max(self._losses[cell.identity()] for cell in unit.cells) < MOST_LOSSES
