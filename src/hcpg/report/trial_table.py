"""The paper's table of the real arm, from trials: successes, steps, intervals, and how two policies differ.

Source: paper, the real-robot evaluation's table. Its completion steps are those of successes alone; a policy
that fails at hard starts looks fast by them, so the mean with failures counted as the cap stands beside it.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hcpg.report.differences import Count, Estimate, fisher, newcombe
from hcpg.report.records import RecordError
from hcpg.report.statistics import Interval, Spread, spread, wilson
from hcpg.report.trial_records import Attempt, Study

OVERALL = "Overall"


class Cell(NamedTuple):
    """One policy on one task, or on all."""

    tally: Count
    rate: Interval
    """Wilson's, 95 %."""
    steps: float
    """Mean actions to the first hit, over the successes; NaN if there are none."""
    deviation: float
    """Sample SD of the same; NaN for fewer than two, and where it is a mean over tasks."""
    capped: float
    """The mean with every failure as the task's horizon."""


class Contrast(NamedTuple):
    """Two policies on one task, or on all tasks' trials together."""

    task: str
    first: str
    second: str
    difference: Estimate
    """Of the success rates, the first minus the second; Newcombe's interval, 95 %."""
    p: float
    """Fisher's, two-sided."""


class TrialTable(NamedTuple):
    """All tasks."""

    kind: str
    """`twin` or `real`."""
    served: bool
    """Whether the arm was reached over its own protocol."""
    tasks: list[str]
    policies: list[str]
    """In the order of the plans; the initial policy, if there is one, as given."""
    horizons: dict[str, int]
    planned: dict[str, int]
    """Trials of each policy, by task."""
    cells: dict[tuple[str, str], Cell]
    """By task (or `OVERALL`, where several are) and policy; a pair without trials is not there."""
    contrasts: list[Contrast]


def trial_table(studies: Sequence[Study]) -> TrialTable:
    """The numbers of all tasks.

    Raises:
        RecordError: there are no trials, or some are of a twin and some of an arm.
    """
    kind, served = _one_kind(studies)
    policies = list(dict.fromkeys(name for study in studies for name in study.policies))
    cells = {}
    for study in studies:
        for policy in study.policies:
            if attempts := study.counted(policy):
                cells[study.plan["task"], policy] = _cell(attempts, study.plan["horizon"])
    if not cells:
        raise RecordError("no trial has ended yet; run some")
    tasks = [study.plan["task"] for study in studies]
    for policy in policies if len(tasks) > 1 else []:
        if all((task, policy) in cells for task in tasks):
            cells[OVERALL, policy] = _overall([cells[task, policy] for task in tasks])
    return TrialTable(
        kind=kind,
        served=served,
        tasks=tasks,
        policies=policies,
        horizons={study.plan["task"]: study.plan["horizon"] for study in studies},
        planned={study.plan["task"]: study.plan["trials"] for study in studies},
        cells=cells,
        contrasts=[
            Contrast(task, first, second, *_contrast(cells[task, first].tally, cells[task, second].tally))
            for task in [*tasks, OVERALL]
            for first, second in combinations(policies, 2)
            if (task, first) in cells and (task, second) in cells
        ],
    )


def _one_kind(studies: Sequence[Study]) -> tuple[str, bool]:
    found = {(study.plan["kind"], study.plan["served"]) for study in studies}
    if not found:
        raise RecordError("there are no trials; make some: hcpg robot trials TASK --robot NAME --out FOLDER")
    if len(found) > 1:
        told = ", ".join(f"{study.folder} ({study.plan['kind']})" for study in studies)
        raise RecordError(
            f"trials on different arms do not belong into one table: {told}; give one at a time"
        )
    return next(iter(found))


def _cell(attempts: Sequence[Attempt], horizon: int) -> Cell:
    hits = np.array([each.steps for each in attempts if each.detector], float)
    count = Count(len(hits), len(attempts))
    steps = spread(hits) if len(hits) else Spread(float("nan"), float("nan"))
    capped = (hits.sum() + horizon * (len(attempts) - len(hits))) / len(attempts)
    return Cell(count, wilson(*count), steps.mean, steps.deviation, float(capped))


def _overall(cells: Sequence[Cell]) -> Cell:
    """Trials pooled, steps as the mean over tasks: as in the paper's last row."""
    count = Count(sum(each.tally.successes for each in cells), sum(each.tally.episodes for each in cells))
    steps, capped = (float(np.mean(each)) for each in zip(*((c.steps, c.capped) for c in cells), strict=True))
    return Cell(count, wilson(*count), steps, float("nan"), capped)


def _contrast(first: Count, second: Count) -> tuple[Estimate, float]:
    return newcombe(first, second), fisher(first, second)
