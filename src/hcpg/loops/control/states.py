"""Whether to act: what is wrong now, and which states may follow each other."""

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

from hcpg.robot_types import Limits, Mode, Snapshot

State = Literal["hold", "run", "reflex", "recover", "reconnect", "stop"]
FOLLOWERS: Mapping[State, tuple[State, ...]] = {
    "hold": ("hold", "run", "reflex", "reconnect", "stop"),
    "run": ("run", "hold", "reflex", "reconnect", "stop"),
    "reflex": ("reflex", "recover", "reconnect", "stop"),
    "recover": ("hold", "recover", "reconnect", "stop"),
    "reconnect": ("hold", "reconnect", "stop"),
    "stop": ("stop",),
}
"""Which states may come next. The way back to `run` leads through `hold`; from `stop` there is none."""


class Evidence(NamedTuple):
    """What is known at a tick."""

    stop: str
    """Why a person or the program wants to stop; "" if nobody does."""
    mode: Mode
    same_epoch: bool
    """Whether the robot is still in the epoch that the episode began in."""
    finite: bool
    """Whether the measured position is three finite numbers."""
    state_age_s: float
    outside_m: float
    """How far the TCP is measured outside the box."""
    gripper_refused: int
    """Gripper commands that failed since the episode began."""
    sight_age_s: float
    """Of the oldest sighting that the task needs; infinite while an object was never seen."""
    sight_limit_s: float


class Verdict(NamedTuple):
    """What to do at a tick."""

    state: State
    cause: str
    """Why it is not a plain `run`; "" where it is."""
    ends: bool = False
    """Whether the episode is over."""
    alone: bool = False
    """Whether to act on one proposal without the selector, because the scene is not known well enough."""


def judge(evidence: Evidence, limits: Limits) -> Verdict:
    """The first thing that is wrong decides, the gravest first."""
    return _fatal(evidence, limits) or _passing(evidence, limits) or _sight(evidence, limits)


def _fatal(evidence: Evidence, limits: Limits) -> Verdict | None:
    """What ends the episode."""
    if evidence.stop:
        return Verdict("stop", evidence.stop, ends=True)
    if evidence.mode == "user_stopped":
        return Verdict("stop", "the user stop is pressed", ends=True)
    if evidence.mode == "disconnected":
        return Verdict("reconnect", "the connection is lost", ends=True)
    if evidence.mode == "reflex" or not evidence.same_epoch:
        cause = "the robot's reflex" if evidence.mode == "reflex" else "a new epoch began in the episode"
        return Verdict("reflex", cause, ends=True)
    if evidence.state_age_s > limits.stale_end_s:
        return Verdict("reconnect", f"no new state for {1000 * evidence.state_age_s:.0f} ms", ends=True)
    return _unsafe(evidence, limits)


def _unsafe(evidence: Evidence, limits: Limits) -> Verdict | None:
    if evidence.finite and evidence.outside_m > limits.outside_m:
        return Verdict("hold", f"the arm is {1000 * evidence.outside_m:.0f} mm outside its box", ends=True)
    if evidence.gripper_refused > limits.gripper_refusals:
        return Verdict("hold", f"the gripper refused {evidence.gripper_refused} commands", ends=True)
    return None


def _passing(evidence: Evidence, limits: Limits) -> Verdict | None:
    """What may get better by itself: hold meanwhile."""
    if not evidence.finite:
        return Verdict("hold", "the measured position is not finite")
    if evidence.state_age_s > limits.stale_hold_s:
        return Verdict("hold", f"no new state for {1000 * evidence.state_age_s:.0f} ms")
    if evidence.mode not in ("idle", "move"):
        return Verdict("hold", f"the robot is in mode {evidence.mode}")
    return None


def _sight(evidence: Evidence, limits: Limits) -> Verdict:
    """Too old a sighting: hold, then go on with one proposal. Never seen: there is nothing to go on with."""
    age_s = evidence.sight_age_s
    if age_s <= evidence.sight_limit_s:
        return Verdict("run", "")
    if math.isinf(age_s):
        return Verdict("hold", "an object was never seen")
    cause = f"the object was last seen {1000 * age_s:.0f} ms ago"
    if age_s <= evidence.sight_limit_s + limits.blind_hold_s:
        return Verdict("hold", cause)
    return Verdict("run", cause, alone=True)


class IllegalTransitionError(RuntimeError):
    """A state that must not follow another; a defect of the loop, never of the robot."""


class Machine:
    """The state that the loop is in; it begins in `hold`."""

    def __init__(self) -> None:
        self.state: State = "hold"

    def move(self, state: State) -> bool:
        """Enter `state`; gives whether it is another than before.

        Raises:
            IllegalTransitionError: `FOLLOWERS` does not allow it.
        """
        if state not in FOLLOWERS[self.state]:
            allowed = ", ".join(FOLLOWERS[self.state])
            raise IllegalTransitionError(f"{state} must not follow {self.state}; allowed: {allowed}")
        changed, self.state = state != self.state, state
        return changed


class Freshness:
    """How long ago the robot last said something new, whatever arrives meanwhile."""

    def __init__(self) -> None:
        self._robot_time_s, self._host_time_s = -math.inf, -math.inf

    def age_s(self, snapshot: Snapshot, now_s: float) -> float:
        """Seconds since the newest state; one that is repeated, or older than it, does not count as new."""
        if snapshot.robot_time_s > self._robot_time_s:
            self._robot_time_s, self._host_time_s = snapshot.robot_time_s, snapshot.host_time_s
        return now_s - self._host_time_s
