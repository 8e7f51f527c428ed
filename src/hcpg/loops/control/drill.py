"""A fault on purpose, in the middle of an episode, and what the loop made of it."""

import json
import subprocess
from collections.abc import Callable, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg.interfaces import ReadScene, Rig, RobotTask
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.episodes import Crew
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Purpose, Session, SessionResult
from hcpg.loops.control.step_log import Sink, StepLog
from hcpg.loops.control.stopping import StopButton
from hcpg.loops.control.workers import worker_for
from hcpg.robot_types import Kind, Sight, Snapshot
from hcpg.safety.faults import FaultyRobot
from hcpg.selection import Selector
from hcpg.types import Float

EPISODES, CANDIDATES = 2, 4
FIRST_TICK = 15
"""The fault begins at this tick of the first episode: half a second into it."""


class DrillError(RuntimeError):
    """A drill on a robot that must not be drilled."""


class Disk:
    """A file on a disk that may be full, but for the log's reserve."""

    def __init__(self, path: Path) -> None:
        self.full = False
        self._path, self._file = path, path.open("ab", buffering=0)

    def write(self, content: bytes, /) -> int | None:
        """How many bytes were taken.

        Raises:
            OSError: the disk is full.
        """
        if self.full and self._path.with_name(f".{self._path.name}.reserve").exists():
            raise OSError(28, "No space left on device (injected)")
        return self._file.write(content)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class Site:
    """Everything that a fault can get hold of."""

    def __init__(self, rig: Rig, fault: "Fault") -> None:
        self.robot = FaultyRobot(rig.robot)
        self.spoil: Callable[[np.ndarray], np.ndarray] = lambda proposals: proposals
        """What the policy makes of its proposals."""
        self.blind = False
        self.learner = subprocess.Popen(["sleep", "100000"])
        """A process that stands in for the learner's."""
        self.disk: Disk
        self.button: StopButton
        self._fault, self._eyes = fault, rig.perception
        self._sight: Sight = {}
        self.track: list[np.ndarray] = []
        """Where the arm really was, tick by tick."""

    @property
    def age_limit_s(self) -> float:
        """That of the eyes; the site is the loop's `Perception`."""
        return self._eyes.age_limit_s

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """What the eyes see, or saw last. Called once a tick: here the fault begins and ends."""
        since = len(self.track) - FIRST_TICK
        self.track.append(np.asarray(self.robot.seen.position))
        if since == 0 or (self._fault.repeats and 0 < since < self._fault.ticks):
            self._fault.inject(self)
        if since == self._fault.ticks:
            self._fault.mend(self)
        if not self.blind:
            self._sight = self._eyes.look(snapshot, now_s)
        return self._sight

    def forget(self) -> None:
        """As the eyes."""
        self._sight = {}
        self._eyes.forget()

    def alive(self) -> bool:
        """Whether the learner's process is; the site is the loop's `Learner`, too."""
        return self.learner.poll() is None

    def close(self) -> None:
        """End the process that stands in for the learner's."""
        self.learner.kill()
        self.learner.wait()

    def offer(self, result: EpisodeResult) -> None:
        """Nothing is learned here."""

    def open_disk(self, path: Path) -> Sink:
        """The disk that the log goes to."""
        self.disk = Disk(path)
        return self.disk

    def propose(
        self, size: int, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "..."]:
        """Random proposals of `size` numbers, or what the fault makes of them."""
        return self.spoil(np.random.default_rng(draw).uniform(-1.0, 1.0, (count, size)))


class Fault(NamedTuple):
    """What is injected, and for how many ticks."""

    what: str
    inject: Callable[[Site], None]
    ticks: int = 10**9
    mend: Callable[[Site], None] = lambda site: None
    """What ends it after these ticks."""
    repeats: bool = False
    """Whether it is injected at every tick, until then."""
    purpose: Purpose = "evaluate"
    horizon: int = 60
    """Most actions of each episode."""


class Outcome(NamedTuple):
    """What became of one fault."""

    what: str
    endings: tuple[str, ...]
    """Of the episodes: `success`, `time_limit`, `fault` or `stopped`."""
    cause: str
    """Why the first episode ended."""
    session_ended: str
    """Why the session ended early; "" if it went on to its end."""
    steps_to_success: tuple[int, ...]
    hold_after_ms: float
    """From the fault to the first tick without a command; NaN if the episode went on to its end."""
    held: int
    """Ticks without a command, of all episodes."""
    skipped: int
    """Deadlines missed, of all episodes."""
    moved_while_held_mm: float
    """The furthest that the arm was from where a hold began."""
    furthest_outside_mm: float
    """Of all measured positions, outside the box."""
    applied_while_wrong: int
    """Commands that reached the arm while it was in a reflex, disconnected or stopped by a person."""
    refused: Mapping[str, int]
    """Commands that the driver's gate refused, by reason."""
    limited: Mapping[str, int]
    """Ticks at which a limit changed the action, by limit."""
    ticks: int
    logged: int
    """Steps in the log; each tick has to be there."""
    cost_s: float
    """From the fault to the beginning of the next episode; NaN if there was none."""
    signal: int | None
    """The signal that ended the drill, if one did."""


def drill(
    rig: Rig, kind: Kind, task: RobotTask, read_scene: ReadScene, fault: Fault, folder: Path
) -> Outcome:
    """Inject `fault` into the first of two episodes of random proposals with the selector.

    The log is written into `folder`.

    Raises:
        DrillError: the robot is a real one, or something ended the first episode before the fault.
    """
    if kind == "real":
        raise DrillError("faults are injected on twins only; a real arm has enough of its own")
    site = Site(rig, fault)
    chooser = Chooser(partial(site.propose, task.action_size), _SELECTOR, read_scene, task.action_size, 0)
    clock = site.robot.clock
    log = StepLog(folder / "steps.jsonl", site.open_disk, threaded=False)
    parts = Rig(site.robot, site, rig.stage)
    crew = Crew.of(parts, task, chooser, worker_for(clock, "policy"), log)
    site.button = crew.button
    session = Session(crew, worker_for(clock, "robot calls"), fault.horizon)
    with closing(site):
        done = session.run(range(EPISODES), fault.purpose, site)
    if not done.episodes or len(done.episodes[0].records) <= FIRST_TICK:
        before = done.episodes[0].verdict.cause if done.episodes else done.ended
        raise DrillError(f"{fault.what}: it never came to that, because of something real: {before}")
    return _outcome(fault, site, done, log.path)


_SELECTOR = Selector(candidates=CANDIDATES)


def _outcome(fault: Fault, site: Site, session: SessionResult, log: Path) -> Outcome:
    episodes, first, seen = session.episodes, session.episodes[0], site.robot.seen
    begin_s = first.records[FIRST_TICK].tick.due_s
    last = len(first.records) - (first.ended in ("success", "time_limit"))
    held = [record for record in first.records[FIRST_TICK:last] if record.executed is None]
    return Outcome(
        what=fault.what,
        endings=tuple(each.ended for each in episodes),
        cause=first.verdict.cause,
        session_ended=session.ended,
        steps_to_success=tuple(each.steps_to_success for each in episodes),
        hold_after_ms=1000 * (held[0].tick.woke_s - begin_s) if held else float("nan"),
        held=sum(each.held for each in episodes),
        skipped=sum(each.timing.skipped for each in episodes),
        moved_while_held_mm=_moved_while_held_mm(site, session),
        furthest_outside_mm=1000 * seen.furthest_outside_m,
        applied_while_wrong=seen.applied_while_wrong,
        refused=dict(seen.refused),
        limited=_limited(session),
        ticks=sum(len(each.records) for each in episodes),
        logged=len(_logged_ticks(log)),
        cost_s=episodes[1].records[0].tick.woke_s - begin_s if len(episodes) > 1 else float("nan"),
        signal=session.signal,
    )


def _limited(session: SessionResult) -> dict[str, int]:
    records = [record for episode in session.episodes for record in episode.records]
    touched = [name for record in records if record.limited is not None for name in record.limited.touched]
    return {name: touched.count(name) for name in dict.fromkeys(touched)}


def _logged_ticks(log: Path) -> set[tuple[int, int]]:
    rows = [json.loads(line) for line in log.read_text().splitlines()]
    return {(row["episode"], row["tick"]["number"]) for row in rows if row["kind"] == "step"}


def _moved_while_held_mm(site: Site, session: SessionResult) -> float:
    """Of all holds, the furthest from where the first tick of the hold found the arm."""
    furthest, began = 0.0, None
    records = [record for episode in session.episodes for record in episode.records]
    for record, position in zip(records, site.track, strict=True):
        if record.executed is not None or record.tick.number == 0:
            began = None
        elif began is None:
            began = position
        else:
            furthest = max(furthest, float(np.linalg.norm(position - began)))
    return 1000 * furthest
