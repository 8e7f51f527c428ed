"""Every preset against one of them: by task on the same start states, and over all tasks.

Percent and points; a positive difference speaks for the preset, not for the reference.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hcpg.report.comparison import contrast, outcomes_of
from hcpg.report.differences import Estimate, collapsed, interquartile_mean, probability_of_improvement
from hcpg.report.page.results import DIGITS
from hcpg.report.records import Curve, Group
from hcpg.report.statistics import last_five, spread
from hcpg.types import Float


def contrasts(groups: Sequence[Group], reference: str) -> list[dict[str, Any]]:
    """The last evaluations of every preset against the reference's, on every task that both have.

    Raises:
        RecordError: their start states differ.
    """
    against = {group.task: outcomes_of(group) for group in groups if group.preset == reference}
    found = []
    for group in groups:
        if group.preset == reference or group.task not in against:
            continue
        each = contrast(outcomes_of(group), against[group.task])
        found.append(
            {
                "task": group.task,
                "preset": group.preset,
                "paired": _estimate(each.paired),
                "independent": _estimate(each.independent),
                "verdict": _verdict(each.decisive),
                "conclusion": each.conclusion,
            }
        )
    return found


def across_tasks(groups: Sequence[Group], presets: Sequence[str], reference: str) -> list[dict[str, Any]]:
    """Each preset over all tasks: mean, interquartile mean, and how likely it beats the reference.

    A preset that lacks a task has no means. The probability is over the tasks that both have.

    Raises:
        StatisticsError: a group has fewer than five evaluations.
    """
    curves = {(group.preset, group.task): _curve(group) for group in groups}
    tasks = sorted({task for _, task in curves})
    found = []
    for preset in presets:
        own = {task: curves[preset, task] for task in tasks if (preset, task) in curves}
        means = _means(_scores(own.values())) if len(own) == len(tasks) else {"mean": None, "middle": None}
        both = [task for task in own if preset != reference and (reference, task) in curves]
        improvement = _improvement(own, curves, reference, both)
        counts = {"tasks": len(own), "collapsed": _collapses(own)}
        found.append({"preset": preset, **counts, **means, "improvement": improvement})
    return found


def _means(scores: Float[np.ndarray, "T S"]) -> dict[str, Any]:
    means = spread(scores.mean(axis=1))
    deviation = None if np.isnan(means.deviation) else round(100 * means.deviation, DIGITS)
    middle = _estimate(interquartile_mean(scores))
    return {"mean": {"mean": round(100 * means.mean, DIGITS), "deviation": deviation}, "middle": middle}


def _improvement(
    own: Mapping[str, Curve], curves: Mapping[tuple[str, str], Curve], reference: str, tasks: Sequence[str]
) -> dict[str, float] | None:
    if not tasks:
        return None
    ours, theirs = _scores(own[task] for task in tasks), _scores(curves[reference, task] for task in tasks)
    return _estimate(probability_of_improvement(ours, theirs))


def _collapses(own: Mapping[str, Curve]) -> list[int]:
    """Runs that lost what they had reached, and all runs."""
    lost = [collapsed(curve.rates) for curve in own.values()]
    return [int(sum(each.sum() for each in lost)), sum(map(len, lost))]


def _curve(group: Group) -> Curve:
    curve = group.curve(group.selector)
    assert curve is not None  # the table of the same groups has refused what has no evaluations in common
    return curve


def _scores(curves: Iterable[Curve]) -> Float[np.ndarray, "T S"]:
    return np.stack([last_five(curve.rates) for curve in curves])


def _estimate(each: Estimate) -> dict[str, float]:
    low, high = each.interval
    values = {"estimate": each.estimate, "low": low, "high": high}
    return {name: round(100 * value, DIGITS) for name, value in values.items()}


def _verdict(difference: Estimate) -> str:
    if not difference.settled:
        return "undecided"
    return "better" if difference.estimate > 0 else "worse"
