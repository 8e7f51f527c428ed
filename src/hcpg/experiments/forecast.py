"""How long an experiment will still take, from how fast its runs have been so far."""

import heapq
from collections.abc import Iterable
from statistics import mean

from hcpg.experiments.ledger import DONE, Entry


def hours_left(entries: list[Entry], slots: int) -> float | None:
    """Hours until every run is done, `slots` of them at a time, the longest ones first.

    A run is taken to be as fast as those of its preset on its task were, or else of its preset, or else all.
    None while no run has got past its warm-up.
    """
    speeds = _speeds(entries)
    if not speeds:
        return None
    seconds = [_seconds_left(entry, speeds) for entry in entries if entry.state not in DONE]
    ends = [0.0] * slots
    for each in sorted(seconds, reverse=True):
        heapq.heapreplace(ends, ends[0] + each)
    return max(ends) / 3600


def _speeds(entries: Iterable[Entry]) -> dict[tuple[str, ...], float]:
    """Seconds per environment step by (task, preset), by (preset,) and of all, ()."""
    seen: dict[tuple[str, ...], list[float]] = {}
    for entry in entries:
        # During warm-up nothing is learned: its steps are faster than those to come.
        if entry.step > entry.cell.settings.budget.warmup_steps:
            for key in _keys(entry):
                seen.setdefault(key, []).append(entry.seconds / entry.step)
    return {key: mean(each) for key, each in seen.items()}


def _keys(entry: Entry) -> list[tuple[str, ...]]:
    task, preset = entry.cell.settings.task, entry.cell.settings.preset
    return [(task, preset), (preset,), ()]


def _seconds_left(entry: Entry, speeds: dict[tuple[str, ...], float]) -> float:
    speed = next(speeds[key] for key in _keys(entry) if key in speeds)
    return speed * max(0, entry.cell.settings.budget.steps - entry.step)
