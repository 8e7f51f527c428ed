"""An episode as a learner gets it, live or from its log: rewarded transitions, and what the selector did."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from hcpg.interfaces import RobotTask
from hcpg.loops.control.choosing import Choice
from hcpg.loops.control.records import Acted, EpisodeResult, transitions
from hcpg.types import Batch, Bool, Float

SUCCESS_REWARD, STEP_REWARD = 1.0, -0.01
"""Of an action that completes the task, which ends its episode; and of every other one."""


class Experience(NamedTuple):
    """One episode, whether it ended by itself or was cut off."""

    number: int
    """Of the episode, over all sittings of a run."""
    start: int
    """The start state it was laid out from."""
    ended: str
    """How it ended; `lost` where only its log is left."""
    actions: int
    """Carried out: what a budget counts, also where the outcome was not seen any more."""
    batch: Batch
    """The actions whose outcome was seen, as NumPy arrays of float32."""
    seen: Mapping[str, float]
    """Means over the actions of what the selector did; nothing where no action was carried out."""

    @property
    def success(self) -> bool:
        """Whether the detector said that the task was done."""
        return self.ended == "success"


class Logged(NamedTuple):
    """A tick as the log has it; what `transitions` asks for."""

    executed: Float[np.ndarray, " A"] | None
    observation: Float[np.ndarray, " O"] | None
    choice: Choice | None
    success: bool


def experienced(number: int, result: EpisodeResult, task: RobotTask) -> Experience:
    """What a live episode was."""
    return _of(number, result.start, result.ended, result.records, task)


def recovered(number: int, start: int, rows: Iterable[Mapping[str, Any]], task: RobotTask) -> Experience:
    """The same from the rows that the step log has of an episode."""
    records = [_logged(row) for row in rows]
    ended = "success" if any(record.success for record in records) else "lost"
    return _of(number, start, ended, records, task)


def _of(number: int, start: int, ended: str, records: Sequence[Acted], task: RobotTask) -> Experience:
    found = transitions(records)
    success = np.asarray([each.success for each in found], bool)
    batch = Batch(
        _rows([each.observation for each in found], task.observation_size),
        _rows([each.executed for each in found], task.action_size),
        rewards(success),
        _rows([each.next_observation for each in found], task.observation_size),
        success.astype(np.float32),
    )
    acted = [record for record in records if record.executed is not None]
    return Experience(number, start, ended, len(acted), batch, _seen(acted))


def rewards(success: Bool[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """The reward of each action, by whether it completed the task: sparse, with a price on time."""
    return np.where(success, SUCCESS_REWARD, STEP_REWARD).astype(np.float32)


def _rows(vectors: list[Float[np.ndarray, " N"]], size: int) -> Float[np.ndarray, "T N"]:
    return np.asarray(vectors, np.float32).reshape(-1, size)


def _seen(acted: Sequence[Acted]) -> dict[str, float]:
    """Spread of the candidates, entropy of their weights (nats) and phase."""
    choices = [record.choice for record in acted if record.choice is not None]
    if not choices:
        return {}
    entropies = [-float(np.sum(each.weights * np.log(np.maximum(each.weights, 1e-12)))) for each in choices]
    phases = [each.phase for each in choices if np.isfinite(each.phase)]
    return {
        "selector_spread": float(np.mean([each.spread for each in choices])),
        "selector_weight_entropy": float(np.mean(entropies)),
        "selector_phase": float(np.mean(phases)) if phases else float("nan"),
    }


def _logged(row: Mapping[str, Any]) -> Logged:
    told = row["choice"]
    return Logged(
        None if row["executed"] is None else np.asarray(row["executed"]),
        None if row["observation"] is None else np.asarray(row["observation"], np.float32),
        None if told is None else Choice(**{name: _number(value) for name, value in told.items()}),
        bool(row["success"]),
    )


def _number(value: Any) -> Any:
    """A logged value as it was: lists are arrays again, null is NaN again."""
    if value is None:
        return np.nan
    return np.asarray(value, np.float64) if isinstance(value, list) else value
