"""Bars of last-five success per task and method, as in the paper, with a dot for every seed.

Source: paper, the figures of Meta-World and ManiSkill last-five success.
"""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.paper_tables import METHODS, method_name, task_name
from hcpg.report.protocol import one_protocol
from hcpg.report.records import Group
from hcpg.report.statistics import Spread, last_five, spread
from hcpg.report.styles import COLUMN_IN, PAGE_IN, Style, blank, drawing, styles_of
from hcpg.types import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AVERAGE = "Avg"
COLUMN_BARS = 40
"""More bars than this need the whole page's width."""
CAPTION = (
    "{suite}: last-five success. Bars are means over seeds, black whiskers ±1 sample SD (how much seeds "
    "differ: no confidence interval, and not bounded by 0 and 100), dots the seeds. The shaded group has the "
    "mean over tasks, its whiskers the SD over the tasks' means."
)
Seeds = Float[np.ndarray, " S"]


def suites_of(groups: Sequence[Group]) -> dict[str, list[Group]]:
    """The groups by the suite of their task."""
    names = sorted({group.task.partition("/")[0] for group in groups})
    return {name: [group for group in groups if group.task.partition("/")[0] == name] for name in names}


def ordered(presets: Sequence[str]) -> list[str]:
    """The paper's methods in the order of its columns, then the others by name."""
    known = list(METHODS)
    return sorted(set(presets), key=lambda preset: (known.index(preset) if preset in known else 99, preset))


def seeds_last_five(groups: Sequence[Group]) -> dict[tuple[str, str], Seeds]:
    """Last-five success of every seed in percent, by (task, preset).

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    one_protocol(groups)
    found = {}
    for group in groups:
        curve = group.curve(group.selector)
        assert curve is not None  # `one_protocol` refuses such a group
        found[group.task, group.preset] = 100 * last_five(curve.rates)
    return found


def success_bars(groups: Sequence[Group]) -> "Figure":
    """The bars of one suite's groups, one column wide, or a page if there are many.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
        StyleError: more presets than can be told apart.
    """
    values = seeds_last_five(groups)
    tasks = sorted({task for task, _ in values})
    presets = ordered([preset for _, preset in values])
    styles = styles_of(presets)
    places = [*tasks, AVERAGE] if len(tasks) > 1 else tasks
    with drawing():
        width_in = COLUMN_IN if len(places) * len(presets) <= COLUMN_BARS else PAGE_IN
        figure = blank(width_in, 2.2)
        axes = figure.subplots()
        for number, preset in enumerate(presets):
            offset = (number - (len(presets) - 1) / 2) * _bar_width(presets)
            _method(axes, values, tasks, preset, offset, styles[preset])
        _frame(axes, places)
        columns = 3 if width_in == COLUMN_IN else min(len(presets), 7)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False)
    return figure


def _bar_width(presets: Collection[str]) -> float:
    return 0.84 / len(presets)


def _method(
    axes: "Axes",
    values: dict[tuple[str, str], Seeds],
    tasks: Sequence[str],
    preset: str,
    offset: float,
    style: Style,
) -> None:
    """One method's bars; it has an average where it has every task."""
    width = _bar_width({each for _, each in values})
    seeds = {place: values[task, preset] for place, task in enumerate(tasks) if (task, preset) in values}
    spreads = {place: spread(each) for place, each in seeds.items()}
    if len(tasks) > 1 and len(seeds) == len(tasks):
        spreads[len(tasks)] = spread(np.array([each.mean for each in spreads.values()]))
    _bars(axes, {place + offset: each for place, each in spreads.items()}, width, method_name(preset), style)
    places = len(tasks) + (len(tasks) > 1)
    for place in {*range(places)} - {*spreads}:
        axes.text(place + offset, 0.5, "–", ha="center", va="bottom")  # no runs, as in the table
    for place, each in seeds.items():
        spaced = np.linspace(-0.25, 0.25, len(each)) * width if len(each) > 1 else np.zeros(1)
        axes.plot(
            place + offset + spaced, each, "o", markersize=1.7, color="white", markeredgecolor="black",
            markeredgewidth=0.4, clip_on=False, zorder=4,
        )  # fmt: skip


def _bars(axes: "Axes", spreads: dict[float, Spread], width: float, label: str, style: Style) -> None:
    means = [each.mean for each in spreads.values()]
    deviations = np.nan_to_num([each.deviation for each in spreads.values()])
    axes.bar(
        list(spreads), means, width * 0.92, yerr=deviations, label=label, color=style.color,
        hatch=style.hatch, edgecolor="black", linewidth=0.4,
        error_kw={"elinewidth": 0.7, "capsize": 1.2, "capthick": 0.7, "ecolor": "black"},
    )  # fmt: skip


def _frame(axes: "Axes", places: Sequence[str]) -> None:
    if places[-1] == AVERAGE:
        axes.axvspan(len(places) - 1.5, len(places) - 0.5, color="0.92", zorder=0)
    names = [AVERAGE if place == AVERAGE else task_name(place) for place in places]
    turned = {"rotation": 25, "ha": "right", "rotation_mode": "anchor"} if len(places) > 4 else {}
    axes.set_xticks(range(len(places)), names, **turned)
    axes.tick_params(axis="x", length=0)
    axes.set_xlim(-0.5, len(places) - 0.5)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.0), max(high, 102.0))
    axes.set_yticks(range(0, 101, 20))
    axes.spines["bottom"].set_visible(False)
    axes.axhline(0, color="black", linewidth=0.6)
    axes.set_ylabel("last-five success, %")
    axes.grid(axis="y", color="0.88", linewidth=0.5)
