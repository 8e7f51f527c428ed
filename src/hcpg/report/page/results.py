"""What each preset reached on each task, as the page's tables and curves show it.

Rates are in percent. Every number is made here; the page only prints and draws.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from hcpg.report.differences import collapsed
from hcpg.report.records import BARE, Curve, Group
from hcpg.report.statistics import Interval, auc, final, last_five, spread, steps_to, wilson

METRICS = ("last_five", "auc", "final")
DIGITS = 6
"""Enough that what the page rounds to tenths comes out as in the other tables."""
LEVEL = 0.8
"""The rate whose first evaluation is shown as steps to success."""
_wilson = lru_cache(maxsize=100_000)(wilson)


def results(groups: Sequence[Group]) -> list[dict[str, Any]]:
    """One entry per group; `bare` is None where the preset is evaluated bare alone.

    Raises:
        StatisticsError: a group has fewer than five evaluations.
    """
    return [_result(group) for group in groups]


def _result(group: Group) -> dict[str, Any]:
    bare = group.curve(BARE) if group.selector != BARE else None
    own = group.curve(group.selector)
    assert own is not None  # the table of the same groups has refused what has no evaluations in common
    return {
        "task": group.task,
        "preset": group.preset,
        "selector": None if group.selector == BARE else group.selector,
        "seeds": [run.seed for run in group.runs],
        "own": summary(own),
        "bare": None if bare is None else summary(bare),
        "hours": _rounded([float(np.mean([run.wall_s for run in group.runs])) / 3600])[0],
    }


def task_means(found: Sequence[dict[str, Any]], presets: Sequence[str]) -> dict[str, Any]:
    """The table's last row: by policy and metric, mean and SD over the tasks' means of every preset.

    A preset that lacks a task is not there.
    """
    tasks = {each["task"] for each in found}
    own = {preset: [each for each in found if each["preset"] == preset] for preset in presets}
    complete = {preset: each for preset, each in own.items() if len(each) == len(tasks)}
    return {
        policy: {
            metric: {
                preset: _summarised([(each[policy] or each["own"])[metric]["mean"] for each in rows])
                for preset, rows in complete.items()
            }
            for metric in METRICS
        }
        for policy in ("own", "bare")
    }


def summary(curve: Curve) -> dict[str, Any]:
    """The curve with its bands, and what the paper reads from it, by seed and over seeds.

    Raises:
        StatisticsError: fewer than five evaluations.
    """
    successes, episodes = (counts.sum(axis=0).tolist() for counts in (curve.successes, curve.episodes))
    bounds = [_wilson(*counts) for counts in zip(successes, episodes, strict=True)]
    deviation = curve.rates.std(axis=0, ddof=1) if len(curve.rates) > 1 else np.full(len(bounds), np.nan)
    return {
        "steps": curve.steps.tolist(),
        "mean": _percent(curve.rates.mean(axis=0)),
        "deviation": _percent(deviation),
        "low": _percent([bound.low for bound in bounds]),
        "high": _percent([bound.high for bound in bounds]),
        "seeds": [_percent(rates) for rates in curve.rates],
        "last_five": _summarised(100 * last_five(curve.rates)),
        "auc": _summarised(auc(curve.steps, curve.rates)),
        "final": _summarised(100 * final(curve.rates)) | _counted(successes[-1], episodes[-1], bounds[-1]),
        "reached": [steps_to(curve.steps, rates, LEVEL) for rates in curve.rates],
        "collapsed": int(collapsed(curve.rates).sum()),
    }


def _summarised(values: Sequence[float] | np.ndarray) -> dict[str, Any]:
    mean, deviation = spread(np.asarray(values))
    rounded_mean, rounded_deviation = _rounded([mean, deviation])
    return {"mean": rounded_mean, "deviation": rounded_deviation, "values": _rounded(values)}


def _counted(successes: int, episodes: int, interval: Interval) -> dict[str, Any]:
    low, high = _percent(interval)
    return {"successes": successes, "episodes": episodes, "low": low, "high": high}


def _percent(rates: Sequence[float] | np.ndarray) -> list[float | None]:
    return _rounded(100 * np.asarray(rates))


def _rounded(values: Sequence[float] | np.ndarray) -> list[float | None]:
    """Numbers as JSON has them: None for what is not one."""
    return [round(value, DIGITS) if np.isfinite(value) else None for value in np.asarray(values).tolist()]
