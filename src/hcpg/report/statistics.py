"""The numbers of a table: intervals for counts, and the paper's summaries of evaluations over training.

Rates are in [0, 1] unless a name says percent.
"""

from typing import NamedTuple

import numpy as np

from hcpg.types import Float, Int


class StatisticsError(ValueError):
    """Too few numbers, or numbers out of range; the message says which."""


class Interval(NamedTuple):
    """Bounds of a confidence interval."""

    low: float
    high: float


class Spread(NamedTuple):
    """Seeds (or tasks) summarised."""

    mean: float
    deviation: float
    """Sample standard deviation (n - 1); NaN for a single one."""


def wilson(successes: int, episodes: int, confidence: float = 0.95) -> Interval:
    """The Wilson score interval of a success rate.

    It says how well the episodes measure this policy; it does not cover how much seeds differ.

    Raises:
        StatisticsError: no episodes, or not 0 <= successes <= episodes.
    """
    from scipy.stats import binomtest

    if episodes < 1 or not 0 <= successes <= episodes:
        raise StatisticsError(
            f"{successes} successes of {episodes} episodes; need 0 <= successes <= episodes >= 1"
        )
    found = binomtest(successes, episodes).proportion_ci(confidence, method="wilson")
    return Interval(float(found.low), float(found.high))


def last_five(rates: Float[np.ndarray, "S T"]) -> Float[np.ndarray, " S"]:
    """The mean of the last five evaluations, per seed.

    Raises:
        StatisticsError: fewer than five evaluations.
    """
    if rates.shape[-1] < 5:
        raise StatisticsError(
            f"last-five needs five evaluations, got {rates.shape[-1]}; train on or evaluate oftener"
        )
    return rates[..., -5:].mean(axis=-1)


def final(rates: Float[np.ndarray, "S T"]) -> Float[np.ndarray, " S"]:
    """The last evaluation, per seed.

    Raises:
        StatisticsError: no evaluation.
    """
    if rates.shape[-1] < 1:
        raise StatisticsError("no evaluation yet; train up to the first one")
    return rates[..., -1]


def auc(steps: Int[np.ndarray, " T"], rates: Float[np.ndarray, "S T"]) -> Float[np.ndarray, " S"]:
    """The area under the curve in percent, per seed: trapezoids over steps scaled to [0, 1].

    0 is the first evaluation (an evaluation before training counts) and 1 the last, so a constant rate r
    gives 100 r.

    Raises:
        StatisticsError: fewer than two evaluations.
    """
    if len(steps) < 2:
        raise StatisticsError(f"the area needs two evaluations, got {len(steps)}; train on")
    return 100 * np.trapezoid(rates, (steps - steps[0]) / (steps[-1] - steps[0]), axis=-1)


def steps_to(steps: Int[np.ndarray, " T"], rates: Float[np.ndarray, " T"], level: float) -> int | None:
    """Environment steps at the first evaluation of at least `level`; None if there is none."""
    reached = np.flatnonzero(rates >= level)
    return int(steps[reached[0]]) if reached.size else None


def spread(values: Float[np.ndarray, " S"]) -> Spread:
    """Mean and sample standard deviation over seeds, or over the means of tasks.

    Raises:
        StatisticsError: no values.
    """
    if len(values) == 0:
        raise StatisticsError("no values to summarise")
    deviation = float(values.std(ddof=1)) if len(values) > 1 else float("nan")
    return Spread(float(values.mean()), deviation)
