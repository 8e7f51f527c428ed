"""One Markdown table per task: presets as columns, what they reached as rows; reads well as plain text."""

import math
from collections.abc import Callable, Sequence

from hcpg.report.differences import collapsed
from hcpg.report.records import BARE, Curve, Group
from hcpg.report.statistics import auc, final, last_five, spread, steps_to, wilson

NOTE = (
    "Success is success_once in percent. [..] is the 95 % Wilson interval over the episodes of all seeds "
    "together; ± is the sample SD over seeds."
)
_ABSENT = "-"
_LEVEL = 0.8


def markdown(groups: Sequence[Group]) -> str:
    """All tables with a heading per task, and one note that says what the numbers are."""
    tasks = sorted({group.task for group in groups})
    parts = [f"### {task}\n\n{_table([group for group in groups if group.task == task])}" for task in tasks]
    return "\n\n".join([*parts, NOTE]) + "\n"


def _table(groups: Sequence[Group]) -> str:
    rows: dict[str, Callable[[Group], str]] = {
        "seeds": lambda group: " ".join(str(run.seed) for run in group.runs),
        "adapter": lambda group: " ".join(sorted({run.adapter for run in group.runs})),
        "selector": lambda group: "none" if group.selector == BARE else group.selector,
        "state": _states,
        "evaluated at step": _last_step,
        "last evaluation": lambda group: _success(group.curve(group.selector)),
        "- by seed": lambda group: _by_seed(group.curve(group.selector)),
        "- bare actor": lambda group: _success(group.curve(BARE)),
        "- bare, by seed": lambda group: _by_seed(group.curve(BARE)),
        "last five": _last_five,
        "AUC": _area,
        "steps to 80 %": _steps_to_level,
        "fell below 50 % after 80 %": _collapses,
        "steps/s per seed": lambda group: _number([run.steps_per_s for run in group.runs]),
        "wall time, s": lambda group: _number([run.wall_s for run in group.runs]),
    }
    lines = [["", *(group.preset for group in groups)]]
    lines += [[name, *(cell(group) for group in groups)] for name, cell in rows.items()]
    return aligned(lines)


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table whose first line is its heading; the columns are equally wide in plain text, too."""
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    texts = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in lines
    ]
    rule = "|" + "|".join("-" * (width + 2) for width in widths) + "|"
    return "\n".join([texts[0], rule, *texts[1:]])


def _states(group: Group) -> str:
    states = [run.status["state"] for run in group.runs]
    return states[0] if len(set(states)) == 1 else " ".join(states)


def _last_step(group: Group) -> str:
    curve = group.curve(group.selector)
    return _ABSENT if curve is None or not curve.steps.size else f"{curve.steps[-1]:,}"


def _success(curve: Curve | None) -> str:
    if curve is None or not curve.steps.size:
        return _ABSENT
    successes, episodes = int(curve.successes[:, -1].sum()), int(curve.episodes[:, -1].sum())
    low, high = wilson(successes, episodes)
    return f"{100 * successes / episodes:.1f} [{100 * low:.1f}, {100 * high:.1f}]"


def _by_seed(curve: Curve | None) -> str:
    if curve is None or not curve.steps.size:
        return _ABSENT
    return " ".join(f"{100 * rate:.0f}" for rate in final(curve.rates))


def _last_five(group: Group) -> str:
    curve = group.curve(group.selector)
    if curve is None or curve.steps.size < 5:
        return _ABSENT
    mean, deviation = spread(100 * last_five(curve.rates))
    return _with_deviation(mean, deviation)


def _area(group: Group) -> str:
    curve = group.curve(group.selector)
    if curve is None or curve.steps.size < 2:
        return _ABSENT
    return _with_deviation(*spread(auc(curve.steps, curve.rates)))


def _with_deviation(mean: float, deviation: float) -> str:
    return f"{mean:.1f}" if math.isnan(deviation) else f"{mean:.1f} ± {deviation:.1f}"


def _steps_to_level(group: Group) -> str:
    """Steps of each seed; a seed that never reached the level shows as absent."""
    curves = [run.curves[group.selector] for run in group.runs]
    reached = [steps_to(curve.steps, curve.rates, _LEVEL) for curve in curves]
    return " ".join(_ABSENT if steps is None else f"{steps:,}" for steps in reached)


def _collapses(group: Group) -> str:
    """How many seeds lost what they had reached."""
    lost = [bool(collapsed(run.curves[group.selector].rates[None])[0]) for run in group.runs]
    return f"{sum(lost)} of {len(lost)}"


def _number(values: Sequence[float]) -> str:
    mean = sum(values) / len(values)
    return _ABSENT if math.isnan(mean) else f"{mean:,.0f}"
