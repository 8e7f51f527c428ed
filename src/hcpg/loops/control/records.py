"""What an episode leaves behind: one record per tick, and how it ended."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from hcpg.loops.control.choosing import Choice
from hcpg.loops.control.deadlines import Tick, Timing
from hcpg.loops.control.states import Verdict
from hcpg.robot_types import Ack, Sight, Snapshot
from hcpg.safety.limiting import Limited
from hcpg.types import Float

Ending = Literal["success", "time_limit", "fault", "stopped"]


class StepRecord(NamedTuple):
    """One tick: what was known, what was proposed, what was done."""

    tick: Tick
    snapshot: Snapshot
    sight: Sight
    sight_age_s: float
    """Of the oldest sighting that the task needs."""
    observation: Float[np.ndarray, " O"] | None
    """What the policy read; None while an object was never seen."""
    verdict: Verdict
    """As carried out: a `run` that came to nothing is recorded as the `hold` it was."""
    choice: Choice | None = None
    limited: Limited | None = None
    ack: Ack | None = None
    policy_s: float = float("nan")
    """How long proposing and selecting took."""
    success: bool = False
    """Whether the detector says that the task is done."""

    @property
    def executed(self) -> Float[np.ndarray, " A"] | None:
        """The action after limits where one was carried out, else None."""
        carried_out = self.limited is not None and self.ack is not None and self.ack.applied
        return self.limited.executed if self.limited is not None and carried_out else None

    def row(self, episode: int) -> Mapping[str, Any]:
        """The record for the log."""
        return {"kind": "step", "episode": episode, **self._asdict(), "executed": self.executed}


class EpisodeResult(NamedTuple):
    """How an episode went."""

    start: int
    """The start state it was laid out from."""
    ended: Ending
    verdict: Verdict
    """Of the last tick: the state to go on from, and why it ended."""
    actions: int
    """Carried out; what a budget counts."""
    held: int
    """Ticks without an action."""
    steps_to_success: int
    """Actions until the detector first said yes; -1 if it never did."""
    timing: Timing
    records: tuple[StepRecord, ...]

    def row(self, episode: int) -> Mapping[str, Any]:
        """The result for the log, without the records."""
        facts = {name: value for name, value in self._asdict().items() if name != "records"}
        return {"kind": "episode", "episode": episode, **facts, "sound_timing": self.timing.sound}


class Transition(NamedTuple):
    """One action and what it led to, as replay stores it."""

    observation: Float[np.ndarray, " O"]
    executed: Float[np.ndarray, " A"]
    """After limits."""
    proposals: Float[np.ndarray, "K A"]
    next_observation: Float[np.ndarray, " O"]
    success: bool
    """In the state it led to."""


@runtime_checkable
class Acted(Protocol):
    """What is asked of a tick to make transitions; a `StepRecord`, or what its log has of it."""

    @property
    def executed(self) -> Float[np.ndarray, " A"] | None:
        """The action carried out, if one was."""
        ...

    @property
    def observation(self) -> Float[np.ndarray, " O"] | None:
        """What the policy read, if all was seen."""
        ...

    @property
    def choice(self) -> Choice | None:
        """What was proposed and chosen, if anything was."""
        ...

    @property
    def success(self) -> bool:
        """Whether the task was done."""
        ...


def transitions(records: Sequence[Acted]) -> list[Transition]:
    """Every action that was carried out and whose outcome, at the next tick, was observed."""
    found = []
    for record, after in pairwise(records):
        executed, choice = record.executed, record.choice
        if executed is None or choice is None or record.observation is None or after.observation is None:
            continue
        found.append(
            Transition(record.observation, executed, choice.proposals, after.observation, after.success)
        )
    return found
