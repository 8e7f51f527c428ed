"""How two methods differ, with intervals: by episodes, seeds and tasks, and how much more would settle it.

Rates and differences are in [-1, 1]; a positive difference speaks for the first. scipy and statsmodels have
the formulas; what is resampled here follows the design (seeds, then start states; seeds within each task).
"""

import math
from typing import NamedTuple

import numpy as np

from hcpg.report.statistics import Interval, StatisticsError
from hcpg.types import Bool, Float, Int

RESAMPLES = 10_000
AT_ONCE = 500
"""Resamples of whole tables held in memory together."""


class Estimate(NamedTuple):
    """An estimate with its confidence interval."""

    estimate: float
    interval: Interval

    @property
    def settled(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.interval.low > 0 or self.interval.high < 0


class Count(NamedTuple):
    """Successes out of episodes."""

    successes: int
    episodes: int

    @property
    def rate(self) -> float:
        """The share that succeeded."""
        return self.successes / self.episodes


def newcombe(first: Count, second: Count, confidence: float = 0.95) -> Estimate:
    """The difference of two success rates from independent episodes.

    Source: Newcombe 1998, the hybrid score interval, by statsmodels.

    Raises:
        StatisticsError: no episodes, or not 0 <= successes <= episodes.
    """
    from statsmodels.stats.proportion import confint_proportions_2indep

    for count in (first, second):
        if not 0 <= count.successes <= count.episodes or count.episodes < 1:
            raise StatisticsError(f"{count}; need 0 <= successes <= episodes >= 1")
    low, high = confint_proportions_2indep(
        *first, *second, method="newcomb", compare="diff", alpha=1 - confidence
    )
    return Estimate(first.rate - second.rate, Interval(float(low), float(high)))


def fisher(first: Count, second: Count) -> float:
    """The two-sided p value of Fisher's exact test that both rates are one."""
    from scipy.stats import fisher_exact

    rows = [[count.successes, count.episodes - count.successes] for count in (first, second)]
    return float(np.asarray(fisher_exact(rows)[1]))


def paired_bootstrap(
    first: Bool[np.ndarray, "S E"], second: Bool[np.ndarray, "R F"], confidence: float = 0.95
) -> Estimate:
    """The difference of rates over the same start states: seeds are resampled, then start states in each.

    The bounds are those of infinitely many resamples, exactly. With one seed they cover the start states
    alone; with few seeds they are too narrow, as any bootstrap's are.

    Raises:
        StatisticsError: nothing to compare, or differently many seeds or start states.
    """
    if first.shape != second.shape or first.size == 0:
        raise StatisticsError(f"cannot pair episodes of shapes {first.shape} and {second.shape}")
    gains = first.astype(np.int64) - second.astype(np.int64)
    chances = _chances_of_sums(gains)
    means = np.arange(-gains.size, gains.size + 1) / gains.size
    tail = (1 - confidence) / 2 - 1e-12  # a bound that is met exactly must not be lost to rounding
    low = means[np.argmax(np.cumsum(chances) >= tail)]
    high = means[::-1][np.argmax(np.cumsum(chances[::-1]) >= tail)]
    return Estimate(float(gains.mean()), Interval(float(low), float(high)))


def _chances_of_sums(gains: Int[np.ndarray, "S E"]) -> Float[np.ndarray, " sums"]:
    """How likely each sum from -S E to S E is, when S seeds and then E gains of each are drawn at random.

    A sum of independent draws has the product of their characteristic functions, so this takes no draws.
    """
    (seeds, episodes), size = gains.shape, 2 * gains.size + 1
    turn = np.exp(-2j * np.pi * np.arange(size) / size)
    alike, counts = np.unique(
        np.stack([(gains > 0).mean(1), (gains < 0).mean(1)]), axis=1, return_counts=True
    )
    of_a_seed = np.zeros(size, complex)
    for gain, loss, count in zip(*alike, counts, strict=True):
        of_a_seed += count / seeds * (1 - gain - loss + gain * turn + loss * turn.conj()) ** episodes
    return np.fft.fftshift(np.fft.ifft(of_a_seed**seeds).real)


def interquartile_mean(scores: Float[np.ndarray, "T S"], confidence: float = 0.95, seed: int = 0) -> Estimate:
    """The mean of the middle half of all tasks' seeds; seeds are resampled within each task.

    Source: Agarwal et al. 2021, "Deep RL at the Edge of the Statistical Precipice".

    Raises:
        StatisticsError: no scores.
    """
    from scipy.stats import trim_mean

    if scores.size == 0:
        raise StatisticsError("no scores to take the interquartile mean of")
    random, means = np.random.default_rng(seed), []
    for _ in range(RESAMPLES // AT_ONCE):
        choices = random.integers(scores.shape[1], size=(AT_ONCE, *scores.shape))
        resampled = np.take_along_axis(scores[None], choices, axis=2)
        means.append(trim_mean(resampled.reshape(AT_ONCE, -1), 0.25, axis=1))
    return Estimate(float(trim_mean(scores.ravel(), 0.25)), _percentiles(np.concatenate(means), confidence))


def probability_of_improvement(
    first: Float[np.ndarray, "T S"], second: Float[np.ndarray, "U R"], confidence: float = 0.95, seed: int = 0
) -> Estimate:
    """How likely a run of the first beats a run of the second on the same task, averaged over tasks.

    0.5 means no difference; a tie counts half. The interval comes from seeds resampled within each task.

    Source: Agarwal et al. 2021.

    Raises:
        StatisticsError: different tasks, or no scores.
    """
    if len(first) != len(second) or first.size == 0 or second.size == 0:
        raise StatisticsError(f"cannot compare scores of shapes {first.shape} and {second.shape} by task")
    random, shares, estimate = np.random.default_rng(seed), np.zeros(RESAMPLES), 0.0
    for ours, theirs in zip(first, second, strict=True):
        wins = np.sign(ours[:, None] - theirs[None]) / 2 + 0.5
        weights, others = (_multiplicities(random, len(each)) for each in (ours, theirs))
        shares += ((weights @ wins) * others).sum(axis=1)
        estimate += wins.mean()
    return Estimate(float(estimate / len(first)), _percentiles(shares / len(first), confidence))


def collapsed(
    rates: Float[np.ndarray, "S T"], reached: float = 0.8, below: float = 0.5
) -> Bool[np.ndarray, " S"]:
    """Which seeds had an evaluation of at least `reached` and a later one of less than `below`."""
    best_before = np.maximum.accumulate(rates, axis=1)[:, :-1]
    return np.any((best_before >= reached) & (rates[:, 1:] < below), axis=1)


def episodes_to_settle(rate: float, other: float, power: float = 0.8, confidence: float = 0.95) -> int | None:
    """Episodes per method for a two-sided test to tell the rates apart with this power; None if equal.

    Raises:
        StatisticsError: a rate that is not in [0, 1].
    """
    from statsmodels.stats.proportion import samplesize_proportions_2indep_onetail

    if not (0 <= rate <= 1 and 0 <= other <= 1):
        raise StatisticsError(f"rates lie in [0, 1], got {rate} and {other}")
    if rate == other:
        return None
    needed = samplesize_proportions_2indep_onetail(rate - other, other, power, alpha=1 - confidence)
    return math.ceil(needed)


def seeds_to_settle(
    first: Float[np.ndarray, " S"],
    second: Float[np.ndarray, " R"],
    power: float = 0.8,
    confidence: float = 0.95,
) -> int | None:
    """Seeds per method for a two-sided t test to tell the means apart with this power.

    None where that cannot be said: one seed, equal means, or no spread at all.
    """
    from statsmodels.stats.power import TTestIndPower

    if min(len(first), len(second)) < 2:
        return None
    deviation = math.sqrt((first.var(ddof=1) + second.var(ddof=1)) / 2)
    difference = abs(float(first.mean() - second.mean()))
    if deviation == 0 or difference == 0:
        return None
    needed = TTestIndPower().solve_power(difference / deviation, alpha=1 - confidence, power=power)
    return math.ceil(float(np.asarray(needed).item()))


def _multiplicities(random: np.random.Generator, seeds: int) -> Float[np.ndarray, "N S"]:
    """How often each seed is drawn in each resample, as its share of the draws."""
    choices = random.integers(seeds, size=(RESAMPLES, seeds)) + seeds * np.arange(RESAMPLES)[:, None]
    return np.bincount(choices.ravel(), minlength=RESAMPLES * seeds).reshape(RESAMPLES, seeds) / seeds


def _percentiles(values: Float[np.ndarray, " N"], confidence: float) -> Interval:
    low, high = np.quantile(values, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Interval(float(low), float(high))
