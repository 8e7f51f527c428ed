"""What a population writes down and tells while it trains: rows, events, divergence."""

import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from hcpg.loops.runs import RunFolder, State

RECENT_EPISODES = 20


class Event(NamedTuple):
    """News of one run, for whoever watches."""

    kind: str
    """`progress`, `evaluation`, or the state a run ended in (`finished`, `stopped`, `diverged`)."""
    seed: int
    facts: dict[str, Any]


Notify = Callable[[Event], None]
Records = list[dict[str, Any]]


class Journal:
    """Writes the rows of R runs, each into its own folder; a diverged run's page is closed."""

    def __init__(
        self, folders: list[RunFolder], seeds: list[int], facts: Mapping[str, Any], notify: Notify
    ) -> None:
        """`facts` go into every row about an episode of training."""
        self._folders, self._seeds, self._facts, self._notify = folders, seeds, dict(facts), notify
        self._pending: dict[str, list[np.ndarray]] = {}
        self._recent = [deque[bool](maxlen=RECENT_EPISODES) for _ in seeds]
        self._last_row = (time.monotonic(), 0)
        self._evaluated: list[set[int]] = [set() for _ in seeds]
        self.alive = [True] * len(seeds)
        """For each run whether it still trains: False once it diverged."""

    def begin(self, step: int) -> None:
        """A sitting begins: rates count from here, and evaluations already written down are known."""
        self._last_row = (time.monotonic(), step)
        self._evaluated = [
            {row["step"] for row in folder.rows("episodes") if row["phase"] == "evaluation"}
            for folder in self._folders
        ]

    def has_evaluation(self, step: int) -> bool:
        """Whether every running run's evaluation at `step` is written down."""
        return all(step in self._evaluated[run] for run in self._running())

    def metrics(self, values: Mapping[str, Any]) -> None:
        """Keep metrics [R] until the next row, which has their means; NaN is "not reported"."""
        for name, each in values.items():
            self._pending.setdefault(name, []).append(each)

    def episodes(self, step: int, run: int, records: Records) -> None:
        """Write down training episodes that ended."""
        if not records or not self.alive[run]:
            return
        self._recent[run].extend(record["success_once"] for record in records)
        rows = [{"step": step, "phase": "train", **self._facts, **record} for record in records]
        self._folders[run].append("episodes", rows)

    def row(self, step: int, updates: int, wall_s: float) -> None:
        """Write down the metrics since the last row and say how far every run is."""
        means = {name: _mean_over_time(values) for name, values in self._pending.items()}
        self._pending = {}
        now, (then, before) = time.monotonic(), self._last_row
        self._last_row = (now, step)
        clock = {"wall_s": wall_s, "steps_per_s": (step - before) / max(now - then, 1e-9)}
        for run in self._running():
            own = {name: float(values[run]) for name, values in means.items() if np.isfinite(values[run])}
            recent = self._recent[run]
            if recent:
                own["train_success"] = sum(recent) / len(recent)
            row = {"step": step, "updates": updates, **clock, **own}
            self._folders[run].append("metrics", [row])
            self._notify(Event("progress", self._seeds[run], row))

    def evaluation(self, step: int, rows: list[Records]) -> None:
        """Write down an evaluation of every run that lacks it."""
        for run in self._running():
            if step in self._evaluated[run]:
                continue
            self._evaluated[run].add(step)
            self._folders[run].append("episodes", rows[run])
            names = dict.fromkeys(row["selector"] for row in rows[run])
            counts = {
                name: [row["success_once"] for row in rows[run] if row["selector"] == name] for name in names
            }
            told = {name: [sum(each), len(each)] for name, each in counts.items()}
            self._notify(Event("evaluation", self._seeds[run], {"step": step, "successes": told}))
        self._last_row = (time.monotonic(), step)  # the evaluation's time is not training's

    def diverged(self, run: int, step: int, quantity: str) -> None:
        """Close the page of a run in which `quantity` is not finite any more."""
        self.alive[run] = False
        self._folders[run].set_status("diverged", step=step, quantity=quantity)
        self._notify(Event("diverged", self._seeds[run], {"step": step, "quantity": quantity}))

    def ended(self, state: State, step: int) -> None:
        """Say of all runs that did not diverge how they ended."""
        for run in self._running():
            self._folders[run].set_status(state, step=step)
            self._notify(Event(state, self._seeds[run], {"step": step}))

    def _running(self) -> list[int]:
        return [run for run, alive in enumerate(self.alive) if alive]


def _mean_over_time(values: list[Any]) -> np.ndarray:
    """Mean over ticks of [T, R] without the NaN; NaN where nothing else is there."""
    stacked = np.asarray([np.asarray(each) for each in values], np.float64)
    reported = ~np.isnan(stacked)
    sums = np.where(reported, stacked, 0.0).sum(axis=0)
    counts = reported.sum(axis=0)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
