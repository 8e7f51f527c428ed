"""What a run's evaluations went with: success beside the critic's error, the noise and what the selector did.

For the question why a run lost what it had reached: did the temperature collapse, did blends leave the
proposals, did the critic overestimate?
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hcpg.report.records import BARE, Record
from hcpg.report.rows import Row, read_rows
from hcpg.report.tables import aligned

ENTROPIES = ("path_entropy", "entropy")
"""What methods call the entropy that their critics' values contain."""
SHOWN = ("temperature", *ENTROPIES, "selector_spread", "selector_blend_gap", "critic_loss")
"""Metrics that stand beside each evaluation, where the run has them."""
HEADING = ("success", "bare", "value", "return", "for entropy", "bias")
_ABSENT = "-"


class Appraisal(NamedTuple):
    """What the critic expected of the bare actor's first actions at one evaluation, and what came of them."""

    value: float
    """Mean over the episodes; NaN where the rows do not say."""
    discounted_return: float
    """Mean over the episodes, of rewards alone."""
    entropy_worth: float
    """The part of the value that is paid for entropy: discount / (1 - discount) * temperature * entropy."""

    @property
    def bias(self) -> float:
        """By how much the critic overestimates, in units of reward."""
        return self.value - self.entropy_worth - self.discounted_return


def appraisal(episodes: Sequence[Row], metrics: Row, discount: float) -> Appraisal:
    """Of one evaluation's rows and the metrics last logged before it.

    The actor is taken to keep its entropy to the end of time, which a time limit that bootstraps allows;
    where nothing pays for entropy, nothing is taken off.
    """
    bare = [row for row in episodes if row["selector"] == BARE]
    value, discounted_return = (_mean([row.get(name) for row in bare]) for name in Appraisal._fields[:2])
    entropy = next((metrics[name] for name in ENTROPIES if metrics.get(name) is not None), 0.0)
    worth = discount / (1 - discount) * (metrics.get("temperature") or 0.0) * entropy
    return Appraisal(value, discounted_return, worth)


def table(run: Record) -> str:
    """A line per evaluation, as Markdown."""
    evaluations: dict[int, list[Row]] = {}
    for row in read_rows(run.path / "episodes.jsonl"):
        if row.get("phase") == "evaluation":
            evaluations.setdefault(row["step"], []).append(row)
    logged = read_rows(run.path / "metrics.jsonl")
    shown = [name for name in SHOWN if any(row.get(name) is not None for row in logged)]
    lines = [["step", *HEADING, *shown]]
    for step, episodes in sorted(evaluations.items()):
        metrics = _last(logged, step)
        found = appraisal(episodes, metrics, run.config["learner"]["discount"])
        rates = (_rate(episodes, name) for name in (run.selector, BARE))
        numbers = (found.value, found.discounted_return, found.entropy_worth, found.bias)
        cells = [*rates, *map(_number, numbers), *(_number(metrics.get(name)) for name in shown)]
        lines.append([f"{step:,}", *cells])
    return aligned(lines)


def page(runs: Sequence[Record]) -> str:
    """Every run's table under its name and the folder it lies in."""
    return "\n\n".join(f"### {run.name} ({run.path.name})\n\n{table(run)}" for run in runs) + "\n"


def _last(logged: Sequence[Row], step: int) -> Row:
    return next((row for row in reversed(logged) if row["step"] <= step), {})


def _mean(values: Sequence[float | None]) -> float:
    given = [value for value in values if value is not None]
    return float(np.mean(given)) if given else math.nan


def _rate(episodes: Sequence[Row], selector: str) -> str:
    own = [row["success_once"] for row in episodes if row["selector"] == selector]
    return f"{100 * sum(own) / len(own):.0f}" if own else _ABSENT


def _number(value: float | None) -> str:
    return _ABSENT if value is None or math.isnan(value) else f"{value:.3g}"
