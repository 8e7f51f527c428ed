"""One episode at 30 Hz: observe, judge, choose, limit, command, write down."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import count

import numpy as np

from hcpg.interfaces import Rig, RobotTask
from hcpg.loops.control.choosing import Choice, Chooser
from hcpg.loops.control.deadlines import Deadlines, Tick
from hcpg.loops.control.records import Ending, EpisodeResult, StepRecord
from hcpg.loops.control.states import Evidence, Freshness, Machine, Verdict, judge
from hcpg.loops.control.step_log import StepLog
from hcpg.loops.control.stopping import StopButton
from hcpg.loops.control.workers import Worker
from hcpg.robot_types import Command, Sight, Snapshot
from hcpg.safety.limiting import Motion, limit, outside_m

POLICY_SHARE = 0.8
"""Part of a period within which the policy has to answer; what is left is for limits and the command."""
PATIENCE_S = 1.0
"""Held for so much longer than it may act, an episode ends."""
DRAWS_PER_EPISODE = 1_000_000
"""The draw of a tick is the episode's number times this, plus the tick's: no two of a run share one."""


@dataclass(frozen=True)
class Crew:
    """Who takes part in an episode; the same for all episodes of a session."""

    rig: Rig
    task: RobotTask
    chooser: Chooser
    worker: Worker
    """Who lets the chooser choose."""
    log: StepLog
    button: StopButton
    machine: Machine
    sequence: Iterator[int]
    """Numbers of the commands, strictly increasing over the session."""

    @classmethod
    def of(cls, rig: Rig, task: RobotTask, chooser: Chooser, worker: Worker, log: StepLog) -> "Crew":
        """A crew with a fresh machine, stop button and count of commands."""
        return cls(rig, task, chooser, worker, log, StopButton(rig.robot), Machine(), count())


class Episode:
    """One episode; `run` goes through it once."""

    def __init__(self, crew: Crew, number: int, start: int, horizon: int) -> None:
        """`horizon` is the most actions; an episode that is held longer than that ends, too."""
        self._crew, self._robot, self._limits = crew, crew.rig.robot, crew.rig.robot.limits
        self._number, self._start, self._horizon = number, start, horizon
        self._period_s = 1.0 / self._limits.rate_hz
        self._detector, self._freshness = crew.task.make_detector(), Freshness()
        self._first = self._robot.observe()
        self._deadlines = Deadlines(self._robot.clock, self._limits.rate_hz)
        self._records: list[StepRecord] = []
        self._actions, self._last_target = 0, None
        self._last_command_s = self._running_since_s = self._robot.clock.now_s()

    def run(self) -> EpisodeResult:
        """Tick until it ends; the arm then holds.

        Raises:
            Exception: whatever the policy raised; the arm holds, and the tick is written down.
        """
        while True:
            record = self._looked(self._deadlines.wait())
            ending, error = self._ending(record), None
            if ending in ("success", "time_limit"):
                record = _not_done(record, ending)
            elif record.verdict.state == "run":
                record, error = self._acted(record)
            if record.executed is None:
                self._held()
            self._written(record)
            if error is not None:
                raise error
            if ending is not None:
                return self._result(ending, record)

    def _looked(self, tick: Tick) -> StepRecord:
        now_s = self._robot.clock.now_s()
        snapshot = self._robot.observe()
        sight = self._crew.rig.perception.look(snapshot, now_s)
        age_s = _oldest_s(sight, self._crew.task.objects, now_s)
        verdict = judge(self._evidence(snapshot, age_s, now_s), self._limits)
        known = np.isfinite(age_s) and verdict.state in ("run", "hold")
        observation = np.asarray(self._crew.task.observe(snapshot, sight)) if known else None
        success = verdict.state == "run" and self._detector.update(snapshot, sight)
        return StepRecord(tick, snapshot, sight, age_s, observation, verdict, success=success)

    def _evidence(self, snapshot: Snapshot, sight_age_s: float, now_s: float) -> Evidence:
        return Evidence(
            stop=self._crew.button.reason or self._crew.log.failure,
            mode=snapshot.mode,
            same_epoch=snapshot.epoch == self._first.epoch,
            finite=bool(np.isfinite(snapshot.position).all()),
            state_age_s=self._freshness.age_s(snapshot, now_s),
            outside_m=outside_m(snapshot.position, self._limits),
            gripper_refused=snapshot.gripper_refusals - self._first.gripper_refusals,
            sight_age_s=sight_age_s,
            sight_limit_s=self._crew.rig.perception.age_limit_s,
        )

    def _ending(self, record: StepRecord) -> Ending | None:
        if record.verdict.ends:
            return "stopped" if record.verdict.state == "stop" else "fault"
        if record.success:
            return "success"
        held_s = (len(self._records) - self._actions) * self._period_s
        if held_s > self._horizon * self._period_s + PATIENCE_S:
            return "fault"
        return "time_limit" if self._actions >= self._horizon else None

    def _acted(self, record: StepRecord) -> tuple[StepRecord, Exception | None]:
        """The record with what was chosen and became of it; what the policy raised, if it did."""
        draw = self._number * DRAWS_PER_EPISODE + record.tick.number
        choose = partial(self._crew.chooser.choose, record.observation, draw, record.verdict.alone)
        if not self._crew.worker.ask(draw, choose):
            return _not_done(record, "the policy is busy with an earlier tick"), None
        answer = self._crew.worker.answer(draw, record.tick.due_s + POLICY_SHARE * self._period_s)
        if answer is None:
            return _not_done(record, "the policy was late"), None
        record = record._replace(policy_s=answer.took_s)
        if answer.error is not None:
            return _not_done(record, f"the policy failed: {answer.error!r}"), answer.error
        return self._commanded(record._replace(choice=answer.value), answer.value), None

    def _commanded(self, record: StepRecord, choice: Choice) -> StepRecord:
        if choice.unfit:
            return _not_done(record, choice.unfit)
        now_s = self._robot.clock.now_s()
        if self._last_target is None:  # the first one after a hold
            self._running_since_s, self._last_command_s = now_s, now_s - self._period_s
        motion = Motion(self._last_target, now_s - self._last_command_s, now_s - self._running_since_s)
        limited = limit(choice.action, record.snapshot, self._limits, motion)
        number = next(self._crew.sequence)
        ack = self._robot.command(Command(number, record.snapshot.epoch, limited.position, limited.grip))
        record = record._replace(limited=limited, ack=ack)
        if not ack.applied:
            return _not_done(record, f"the robot refused the command: {ack.refusal}")
        self._actions += 1
        self._last_target, self._last_command_s = limited.position, now_s
        return record

    def _held(self) -> None:
        """Hold at this tick; whatever comes next begins with short steps."""
        self._robot.hold()
        self._last_target = None

    def _written(self, record: StepRecord) -> None:
        self._crew.machine.move(record.verdict.state)
        self._records.append(record)
        self._crew.log.put(record.row(self._number))

    def _result(self, ending: Ending, last: StepRecord) -> EpisodeResult:
        steps = self._actions if ending == "success" else -1
        held = len(self._records) - self._actions
        timing = self._deadlines.timing()
        records = tuple(self._records)
        return EpisodeResult(self._start, ending, last.verdict, self._actions, held, steps, timing, records)


def _oldest_s(sight: Sight, objects: tuple[str, ...], now_s: float) -> float:
    """Age of the oldest sighting needed; infinite if one is missing, 0 if none ages."""
    seen = [sight[name].seen_s if name in sight else -np.inf for name in objects]
    return max(now_s - min(seen, default=now_s), 0.0)


def _not_done(record: StepRecord, cause: str) -> StepRecord:
    return record._replace(verdict=Verdict("hold", cause))
