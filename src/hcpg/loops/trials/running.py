"""Trial after trial: each a session of one episode, with the policy whose turn it is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.interfaces import Detector, Rig, RobotTask
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.episodes import Crew
from hcpg.loops.control.mending import Patience
from hcpg.loops.control.records import EpisodeResult, StepRecord
from hcpg.loops.control.sessions import Session, SessionResult
from hcpg.loops.control.step_log import StepLog
from hcpg.loops.control.workers import passes_by_itself, worker_for
from hcpg.loops.trials.ledger import Ledger, Turn
from hcpg.loops.trials.operator import NobodyThereError, Operator
from hcpg.report.trial_records import STEPS
from hcpg.robot_types import Sight, Snapshot

MOST_BLIND = 0.1
"""A larger share of an episode's ticks without a fresh sighting, once there was one: the trial is invalid."""
SETTLES_S = 0.3
"""From the last command to the referee's last look."""
Referee = Callable[[], bool]
"""Says from a simulation's physics whether the task is done now."""


class TrialError(RuntimeError):
    """Trials that cannot go on; the message says why."""


@dataclass(frozen=True)
class Arena:
    """Where the trials take place, and who takes part; the same for all of them."""

    rig: Rig
    task: RobotTask
    choosers: Mapping[str, Callable[[int], Chooser]]
    """By policy: what chooses, whose every draw follows from the number given."""
    operator: Operator
    lays_out: bool
    """Whether the rig's own stage lays out the scene; else the operator does."""
    referee: Referee | None
    horizon: int
    patience: Patience | None = None


class Progress(NamedTuple):
    """How far the trials came."""

    ended: str
    """Why they ended early; "" where all are done."""
    signal: int | None


def run_trials(arena: Arena, ledger: Ledger, tell: Callable[[str], None]) -> Progress:
    """Run every trial that is not done yet; `tell` hears of each before it begins.

    Raises:
        NobodyThereError: the operator's input ended.
        LogError: steps could not be written.
        Exception: what a policy raised; the robot is stopped.
    """
    for turn in ledger.unjudged():
        _judge(arena, ledger, turn)
    while (turn := ledger.next()) is not None:
        tell(_called(ledger, turn))
        done = _tried(arena, ledger, turn)
        if done.ended:
            ledger.note(done.ended)
            return Progress(done.ended, done.signal)
    return Progress("", None)


def _tried(arena: Arena, ledger: Ledger, turn: Turn) -> SessionResult:
    """One attempt, written down; gives what the session said of itself."""
    seen = _Refereed(arena.referee)
    stage = _Attended(arena, ledger, turn)
    folder = ledger.folder / turn.folder
    folder.mkdir(exist_ok=True)
    session = _session(arena, turn, seen, stage, folder / STEPS)
    try:
        done = session.run([turn.slot.start])
    except NobodyThereError as error:
        ledger.note(f"fault: {error}")
        raise
    if not stage.begun:
        return done
    clock = arena.rig.robot.clock
    clock.sleep_until(clock.now_s() + SETTLES_S)
    seen.look()
    ledger.end(turn, _facts(arena, done, seen))
    if arena.operator.judges and not _invalid(arena, done):
        _judge(arena, ledger, turn)
    return done


def _session(arena: Arena, turn: Turn, seen: "_Refereed", stage: "_Attended", log: Path) -> Session:
    clock = arena.rig.robot.clock
    chooser = arena.choosers[turn.slot.policy](turn.slot.start)
    task = replace(arena.task, make_detector=lambda: seen.beside(arena.task.make_detector()))
    steps = StepLog(log, threaded=passes_by_itself(clock))
    rig = arena.rig._replace(stage=stage)
    crew = Crew.of(rig, task, chooser, worker_for(clock, "policy"), steps)
    stage.stopped = lambda: crew.button.reason
    return Session(crew, worker_for(clock, "robot calls"), arena.horizon, arena.patience)


def _judge(arena: Arena, ledger: Ledger, turn: Turn) -> None:
    said = arena.operator.opinion(_called(ledger, turn))
    ledger.judge(turn, said.done, said.invalid)


def _called(ledger: Ledger, turn: Turn) -> str:
    """The trial as the operator knows it."""
    again = "" if turn.attempt == 1 else ", again"
    return f"Trial {turn.slot.number} of {ledger.size} ({turn.slot.code}{again})"


class _Attended:
    """A stage on which nothing moves before the operator says so; the attempt begins then."""

    def __init__(self, arena: Arena, ledger: Ledger, turn: Turn) -> None:
        self._arena, self._ledger, self._turn = arena, ledger, turn
        self.stopped: Callable[[], str] = str
        self.begun = False

    def arrange(self, start: int) -> None:
        """Lay the scene out, or have it laid out, and wait for the operator."""
        if self._arena.lays_out:
            self._arena.rig.stage.arrange(start)
        name = _called(self._ledger, self._turn)
        if self._arena.operator.ready(name, start, self.stopped):
            self._ledger.begin(self._turn)
            self.begun = True

    def close(self) -> None:
        """The rig's own stage belongs to whoever made it."""


class _Refereed:
    """Asks the referee at every tick at which the detector is asked."""

    def __init__(self, referee: Referee | None) -> None:
        self._referee = referee
        self.done: bool | None = None if referee is None else False

    def beside(self, detector: Detector) -> Detector:
        """The detector, which the referee watches."""
        self._detector = detector
        return self

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """What the detector says; the referee's word is only kept."""
        self.look()
        return self._detector.update(snapshot, sight)

    def look(self) -> None:
        """Ask the referee; once it has said yes, the task was done."""
        if self._referee is not None:
            self.done = bool(self.done or self._referee())


def _facts(arena: Arena, done: SessionResult, seen: _Refereed) -> dict[str, Any]:
    """The attempt for the ledger."""
    ended = {"referee": seen.done, "invalid": _invalid(arena, done), "to_judge": arena.operator.judges}
    if not done.episodes:
        return {"ended": "stopped", "cause": done.ended, "detector": False, "steps": -1, **ended}
    result = done.episodes[0]
    return {
        **ended,
        "ended": result.ended,
        "cause": result.verdict.cause,
        "detector": result.ended == "success",
        "steps": result.steps_to_success,
        "actions": result.actions,
        "held": result.held,
        "timing": result.timing,
        **_seen(result.records),
    }


def _seen(records: tuple[StepRecord, ...]) -> dict[str, Any]:
    """What the selector and the limits did over the episode."""
    chosen = [each.choice for each in records if each.choice is not None and not each.choice.unfit]
    touched = list(chain.from_iterable(each.limited.touched for each in records if each.limited is not None))
    effective = [1.0 / float(np.square(each.weights).sum()) for each in chosen]
    return {
        "spread": float(np.mean([each.spread for each in chosen])) if chosen else None,
        "effective_candidates": float(np.mean(effective)) if chosen else None,
        "policy_ms_max": 1000
        * max((each.policy_s for each in records if each.choice is not None), default=0.0),
        "limits_touched": {name: touched.count(name) for name in dict.fromkeys(touched)},
    }


def _invalid(arena: Arena, done: SessionResult) -> str:
    """Why the attempt says nothing of the policy; "" where it counts. A fault of the arm counts."""
    if not done.episodes:
        return f"stopped before the first action: {done.ended}"
    result: EpisodeResult = done.episodes[0]
    if result.ended == "stopped":
        return f"stopped: {result.verdict.cause}"
    blind = _blind(result.records, arena.rig.perception.age_limit_s)
    if blind > MOST_BLIND:
        return f"the camera was lost: {100 * blind:.0f} % of the ticks had no fresh sighting"
    return "" if result.timing.sound else f"deadlines were missed: {result.timing.skipped}"


def _blind(records: tuple[StepRecord, ...], limit_s: float) -> float:
    """Share of the ticks without a fresh sighting, from the first one that had one; 1 if none ever had."""
    fresh = np.array([each.sight_age_s <= limit_s for each in records])
    return 1.0 - float(fresh[np.argmax(fresh) :].mean())
