"""What a run showed, read from its two tables: its evaluations as curves, and how long it took."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg.report.episodes import Episodes, read_evaluations
from hcpg.report.rows import last_row
from hcpg.types import Float, Int

BARE = "bare"
"""The selector name under which a method's own action, without any selector, is recorded."""


class RecordError(ValueError):
    """Rows that no honest number can be made of; the message says which and why."""


class Curve(NamedTuple):
    """The evaluations of one run with one selector, in the order of training."""

    steps: Int[np.ndarray, " T"]
    """Environment steps of training when evaluated."""
    successes: Int[np.ndarray, "*seeds T"]
    """Episodes with `success_once`."""
    episodes: Int[np.ndarray, "*seeds T"]
    """Episodes evaluated."""

    @property
    def rates(self) -> Float[np.ndarray, "*seeds T"]:
        """Success rates in [0, 1]."""
        return self.successes / self.episodes


class Measured(NamedTuple):
    """The tables of one run, summed up."""

    adapter: str
    """How the scene was read; empty before the first evaluation."""
    curves: Mapping[str, Curve]
    """By selector, in the order in which they appear."""
    episodes: Mapping[str, Episodes]
    """The same, episode by episode."""
    wall_s: float
    """Time of the training so far; NaN without metrics."""


def measure(path: Path) -> Measured:
    """Read the tables of the run folder `path`.

    Raises:
        RecordError: an evaluation counts a start state twice, or mixes adapters.
        RowError: a line is damaged.
    """
    evaluations = read_evaluations(path / "episodes.jsonl")
    if len(evaluations.adapters) > 1:
        raise RecordError(
            f"{path}: evaluations mix the adapters {', '.join(sorted(evaluations.adapters))}; "
            "report one of them."
        )
    metrics = last_row(path / "metrics.jsonl")
    return Measured(
        adapter=next(iter(evaluations.adapters), ""),
        curves={name: _curve(path, name, each) for name, each in evaluations.by_selector.items()},
        episodes=evaluations.by_selector,
        wall_s=float("nan") if metrics is None else float(metrics.get("wall_s") or "nan"),
    )


def _curve(path: Path, selector: str, rows: Episodes) -> Curve:
    again = (np.diff(rows.steps) == 0) & (np.diff(rows.starts) == 0)
    if again.any():
        place = int(np.argmax(again))
        raise RecordError(
            f"{path}: the evaluation at step {rows.steps[place]} with selector {selector} counts start "
            f"state {rows.starts[place]} twice. Rewind the run to its checkpoint before evaluating again."
        )
    steps, begins, episodes = np.unique(rows.steps, return_index=True, return_counts=True)
    return Curve(steps, np.add.reduceat(rows.successes.astype(np.int64), begins), episodes)
