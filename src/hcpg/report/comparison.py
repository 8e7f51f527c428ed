"""Two presets on the same start states: rates, difference with its interval, and what may be concluded."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg.report.differences import (
    Count,
    Estimate,
    episodes_to_settle,
    newcombe,
    paired_bootstrap,
    seeds_to_settle,
)
from hcpg.report.episodes import Episodes
from hcpg.report.protocol import protocol, shared
from hcpg.report.records import Group, RecordError, load_runs
from hcpg.report.statistics import wilson
from hcpg.types import Bool

FEW_SEEDS = 5
"""With fewer, a bootstrap over seeds is too narrow to speak about other seeds."""


class Outcomes(NamedTuple):
    """The last evaluation of some seeds of one preset on one task."""

    preset: str
    selector: str
    protocol: dict[str, str]
    """What must be equal for a comparison, the seeds apart: task, budget, steps, adapter, episodes."""
    seeds: tuple[int, ...]
    starts: tuple[int, ...]
    successes: Bool[np.ndarray, "S E"]
    """`success_once`, by seed and start state."""

    @property
    def total(self) -> Count:
        """All seeds together."""
        return Count(int(self.successes.sum()), self.successes.size)


def outcomes(root: Path, selector: str | None = None, skip_corrupt: bool = False) -> Outcomes:
    """What the runs at or under `root` reached, with their own evaluation selector unless one is named.

    Raises:
        RecordError: several presets or tasks, no evaluation with the selector, or unequal start states.
    """
    groups = load_runs([root], skip_corrupt)
    if len(groups) > 1:
        found = ", ".join(f"{group.preset} on {group.task}" for group in groups)
        raise RecordError(f"{root} holds {found}; name the folder of one of them.")
    return outcomes_of(groups[0], selector)


def outcomes_of(group: Group, selector: str | None = None) -> Outcomes:
    """The last evaluation that all seeds of the group have in common.

    Raises:
        RecordError: no evaluation with the selector, or unequal start states or settings.
    """
    name, chosen = f"{group.preset} on {group.task}", selector or group.selector
    curve = group.curve(chosen)
    if curve is None or not curve.steps.size:
        known = ", ".join(sorted({name for run in group.runs for name in run.curves}))
        raise RecordError(
            f"{name}: not every seed has an evaluation with {chosen!r}; there are evaluations with {known}."
        )
    step = int(curve.steps[-1])
    last = [_at_step(run.episodes[chosen], step) for run in group.runs]
    starts = tuple(last[0].starts.tolist())
    if any(each.starts.tolist() != list(starts) for each in last):
        raise RecordError(f"{name}: the seeds were evaluated on different start states at step {step:,}.")
    return Outcomes(
        preset=group.preset,
        selector=chosen,
        protocol={"task": group.task, **protocol(group), "steps": f"{step:,}"},
        seeds=tuple(run.seed for run in group.runs),
        starts=starts,
        successes=np.stack([each.successes for each in last]),
    )


def _at_step(rows: Episodes, step: int) -> Episodes:
    there = rows.steps == step
    return Episodes(*(column[there] for column in rows))


class Contrast(NamedTuple):
    """Two presets on the same seeds and start states, and the first's rate less the second's."""

    first: Outcomes
    second: Outcomes
    paired: Estimate
    """Seeds and start states resampled."""
    independent: Estimate
    """Episodes taken as independent (Newcombe)."""

    @property
    def decisive(self) -> Estimate:
        """The paired one, unless all pairs are equal, so that its interval has no width."""
        return self.paired if self.paired.interval.low < self.paired.interval.high else self.independent

    @property
    def conclusion(self) -> str:
        """What may be said of the first against the second, and what may not."""
        return conclusion(self.first, self.second, self.decisive)


def contrast(first: Outcomes, second: Outcomes) -> Contrast:
    """Both on the seeds that they have in common.

    Raises:
        RecordError: another task or protocol, other start states, or no seed in common.
    """
    first, second = _paired(first, second)
    paired = paired_bootstrap(first.successes, second.successes)
    return Contrast(first, second, paired, newcombe(first.total, second.total))


def compared(first: Outcomes, second: Outcomes) -> str:
    """The comparison as plain text.

    Raises:
        RecordError: another task or protocol, other start states, or no seed in common.
    """
    found = contrast(first, second)
    facts, seeds = found.first.protocol, " ".join(map(str, found.first.seeds))
    lines = [
        f"{facts['task']}, adapter {facts['adapter']}, last evaluation at step {facts['steps']}, "
        f"seeds {seeds}, {len(found.first.starts)} start states",
        *(_rates(each) for each in (found.first, found.second)),
        f"difference {100 * found.paired.estimate:+.1f} points",
        f"  paired, seeds and start states resampled: {_points(found.paired)}",
        f"  episodes taken as independent (Newcombe): {_points(found.independent)}",
        found.conclusion,
    ]
    return "\n".join(lines)


def conclusion(first: Outcomes, second: Outcomes, difference: Estimate) -> str:
    """What may be said of `first` against `second`, and what may not."""
    seeds = len(first.seeds)
    limit = "; one seed says nothing of other seeds" if seeds == 1 else ""
    if 1 < seeds < FEW_SEEDS:
        limit = f"; {seeds} seeds say little of other seeds"
    if difference.settled:
        better, worse = (first, second) if difference.estimate > 0 else (second, first)
        return f"{_name(better)} is better than {_name(worse)} on these start states (95 %){limit}."
    if difference.estimate == 0:
        return f"Undecided: the rates are equal{limit}."
    return f"Undecided: the interval includes zero{limit}. {_needed(first, second)}"


def _needed(first: Outcomes, second: Outcomes) -> str:
    seeds = seeds_to_settle(first.successes.mean(axis=1), second.successes.mean(axis=1))
    if seeds is not None:
        return f"If seeds spread as these do, {seeds:,} of each would tell them apart with 80 % power."
    episodes = episodes_to_settle(first.total.rate, second.total.rate)
    return f"If the rates are what they seem, {episodes:,} episodes of each would, with 80 % power."


def _paired(first: Outcomes, second: Outcomes) -> tuple[Outcomes, Outcomes]:
    shared((each.preset, {**each.protocol, "seeds": "any"}) for each in (first, second))
    if first.starts != second.starts:
        raise RecordError(
            f"{first.preset} has {len(first.starts)} start states and {second.preset} {len(second.starts)}, "
            "or others; evaluate both on the same ones."
        )
    common = tuple(seed for seed in first.seeds if seed in second.seeds)
    if not common:
        raise RecordError(
            f"no seed in common: {first.seeds} and {second.seeds}; train both with the same ones."
        )
    return _only(first, common), _only(second, common)


def _only(each: Outcomes, seeds: tuple[int, ...]) -> Outcomes:
    places = [each.seeds.index(seed) for seed in seeds]
    return each._replace(seeds=seeds, successes=each.successes[places])


def _rates(each: Outcomes) -> str:
    low, high = wilson(*each.total)
    by_seed = " ".join(f"{100 * rate:.0f}" for rate in each.successes.mean(axis=1))
    share = f"{100 * each.total.rate:5.1f} [{100 * low:.1f}, {100 * high:.1f}]"
    return f"{_name(each)}: {share} ({each.total.successes}/{each.total.episodes}), by seed {by_seed}"


def _name(each: Outcomes) -> str:
    return f"{each.preset} ({each.selector})"


def _points(difference: Estimate) -> str:
    return f"[{100 * difference.interval.low:+.1f}, {100 * difference.interval.high:+.1f}]"
