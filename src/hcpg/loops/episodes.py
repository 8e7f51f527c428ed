"""What happened in every running episode: return, length, success once, at the end, and when."""

from typing import Any, NamedTuple

import numpy as np

from hcpg.loops.pool import Arrival
from hcpg.types import Bool, Float, Int


class Episodes(NamedTuple):
    """One entry per environment, for the episode it is in."""

    start: Int[np.ndarray, " N"]
    """Start state."""
    number: Int[np.ndarray, " N"]
    """Count of episodes the environment began before this one."""
    length: Int[np.ndarray, " N"]
    reward_sum: Float[np.ndarray, " N"]
    steps_to_success: Int[np.ndarray, " N"]
    """Steps to the first success; -1 if there was none."""

    @classmethod
    def begin(cls, starts: Int[np.ndarray, " N"]) -> "Episodes":
        """Every environment at the beginning of its first episode."""
        zeros = np.zeros(len(starts), np.int64)
        return cls(np.asarray(starts), zeros, zeros.copy(), np.zeros(len(starts)), zeros - 1)

    def advance(
        self, arrival: Arrival, next_starts: Int[np.ndarray, " N"]
    ) -> tuple["Episodes", list[dict[str, Any]]]:
        """The episodes after one step, and a record of each one that ended with it."""
        length, reward_sum = self.length + 1, self.reward_sum + arrival.rewards
        first = arrival.success & (self.steps_to_success < 0)
        steps_to_success = np.where(first, length, self.steps_to_success)
        ended = arrival.terminated | arrival.truncated
        records = [
            {
                "environment": int(index),
                "start": int(self.start[index]),
                "success_once": bool(steps_to_success[index] >= 0),
                "success_at_end": bool(arrival.success[index]),
                "steps_to_success": int(steps_to_success[index]),
                "return": float(reward_sum[index]),
                "length": int(length[index]),
            }
            for index in np.flatnonzero(ended)
        ]
        return self._renew(ended, next_starts, length, reward_sum, steps_to_success), records

    def _renew(
        self,
        ended: Bool[np.ndarray, " N"],
        next_starts: Int[np.ndarray, " N"],
        length: Int[np.ndarray, " N"],
        reward_sum: Float[np.ndarray, " N"],
        steps_to_success: Int[np.ndarray, " N"],
    ) -> "Episodes":
        return Episodes(
            np.where(ended, next_starts, self.start),
            self.number + ended,
            np.where(ended, 0, length),
            np.where(ended, 0.0, reward_sum),
            np.where(ended, -1, steps_to_success),
        )

    def as_json(self) -> dict[str, list]:
        """Plain lists, exact for every field."""
        return {name: values.tolist() for name, values in self._asdict().items()}

    @classmethod
    def from_json(cls, lists: dict[str, list]) -> "Episodes":
        """The episodes that `as_json` wrote down."""
        return cls(**{name: np.asarray(values) for name, values in lists.items()})
