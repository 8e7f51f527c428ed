"""How long a run takes where nothing disturbs it, from its rows of metrics."""

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from statistics import median
from typing import Any


def undisturbed_s(rows: Sequence[Mapping[str, Any]], evaluated: Collection[int | float]) -> float:
    """Seconds of training and evaluations up to the last row, or to an evaluation that followed it.

    The wall time of a run that was suspended, or shared its core for a while, is longer. Here a step takes
    the median of all intervals between rows, and an evaluation the median of what an interval with one takes
    beyond that. The compiler's time, before the first row, is left out. NaN with less than three rows.

    Args:
        rows: rows of metrics, `step` and `wall_s`.
        evaluated: environment steps at which the run was evaluated.
    """
    if len(rows) < 3:
        return float("nan")
    plain, longer = [], []
    for before, row in pairwise(rows):
        steps, seconds = row["step"] - before["step"], row["wall_s"] - before["wall_s"]
        # An evaluation follows the row of its own step.
        within = any(before["step"] <= each < row["step"] for each in evaluated)
        (longer if within else plain).append((steps, seconds))
    a_step = median(seconds / steps for steps, seconds in plain or longer)
    extra = median(seconds - a_step * steps for steps, seconds in longer) if longer else 0.0
    return a_step * rows[-1]["step"] + max(0.0, extra) * len(evaluated)
