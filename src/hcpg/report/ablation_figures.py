"""The ablation as pictures: one row per selector, and success over the number of candidates."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.ablation import CANDIDATES, METRICS, ablated, ablation, ablation_name
from hcpg.report.bars import seeds_last_five
from hcpg.report.paper_tables import task_name
from hcpg.report.records import Group
from hcpg.report.statistics import spread
from hcpg.report.styles import COLUMN_IN, Style, blank, drawing, styles_of
from hcpg.types import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CAPTION = (
    "Selection rules and candidate counts on {tasks}. Bars are means over the task-seed runs; dots are the "
    "seeds, each averaged over the tasks; black whiskers are ±1 sample SD over those."
)
CANDIDATES_CAPTION = (
    "Last-five success over the number of candidates K; K=1 is SAC-Flow, which selects nothing. Points are "
    "means over seeds with ±1 sample SD, dots the seeds; the thick line is the mean over tasks."
)


def ablation_figure(groups: Sequence[Group]) -> "Figure":
    """A panel per metric, a row per complete variant, one column wide.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    variants = [variant for variant in ablation(groups).variants if variant.seeds]
    with drawing():
        figure = blank(COLUMN_IN, 0.55 + 0.19 * len(variants))
        panels = figure.subplots(1, len(METRICS), sharex=True, sharey=True)
        for panel, metric in zip(panels, METRICS, strict=True):
            _metric(panel, {variant.preset: variant.seeds[metric] for variant in variants})
            panel.set_title(f"{metric}, %")
    return figure


def _metric(panel: "Axes", seeds: Mapping[str, Float[np.ndarray, " S"]]) -> None:
    spreads = [spread(each) for each in seeds.values()]
    ours = ["#0072B2" if preset == "hcpg_flow" else "#C8C8C8" for preset in seeds]
    whiskers = {"elinewidth": 0.7, "capsize": 1.5, "capthick": 0.7, "ecolor": "black"}
    panel.barh(
        range(len(seeds)),
        [each.mean for each in spreads],
        0.72,
        xerr=np.nan_to_num([each.deviation for each in spreads]),
        color=ours,
        edgecolor="black",
        linewidth=0.4,
        error_kw=whiskers,
    )
    for place, each in enumerate(seeds.values()):
        heights = place + (np.linspace(-0.2, 0.2, len(each)) if len(each) > 1 else np.zeros(1))
        _dots(panel, each, heights)
    panel.set_yticks(range(len(seeds)), [ablation_name(preset) for preset in seeds])
    panel.set_ylim(len(seeds) - 0.5, -0.5)
    panel.set_xlim(min(panel.get_xlim()[0], 0), max(panel.get_xlim()[1], 100))
    panel.set_xticks([0, 50, 100])
    ends = panel.get_xticklabels()
    ends[0].set_horizontalalignment("left")  # or 100 would touch the next panel's 0
    ends[-1].set_horizontalalignment("right")
    panel.tick_params(axis="y", length=0)
    panel.grid(axis="x", color="0.88", linewidth=0.5)


def candidates_figure(groups: Sequence[Group]) -> "Figure":
    """Last-five success over K, a line per task, one column wide.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    values = seeds_last_five([group for group in ablated(groups) if group.preset in CANDIDATES])
    tasks = sorted({task for task, _ in values})
    counts = sorted({CANDIDATES[preset] for _, preset in values})
    by_task = {task: {CANDIDATES[p]: each for (t, p), each in values.items() if t == task} for task in tasks}
    with drawing():
        figure = blank(COLUMN_IN, 2.1)
        axes = figure.subplots()
        for (task, style), shift in zip(styles_of(tasks).items(), _shifts(len(tasks)), strict=True):
            _task(axes, by_task[task], shift, style, task_name(task))
        complete = [count for count in counts if all(count in own for own in by_task.values())]
        means = [np.mean([by_task[task][count].mean() for task in tasks]) for count in complete]
        axes.plot(np.log2(complete), means, color="black", linewidth=1.8, label="mean over tasks", zorder=2)
        axes.set_xticks(np.log2(counts), [str(count) for count in counts])
        axes.set_xlabel("candidates K")
        axes.set_ylabel("last-five success, %")
        axes.set_ylim(top=max(axes.get_ylim()[1], 102))
        axes.set_yticks(range(0, 101, 25))  # whiskers may reach beyond, success may not
        axes.grid(axis="y", color="0.88", linewidth=0.5)
        figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


def _shifts(count: int) -> Float[np.ndarray, " N"]:
    """Where each task's points stand beside K, so that whiskers do not cover each other."""
    return (np.arange(count) - (count - 1) / 2) * 0.06


def _task(
    axes: "Axes", seeds: Mapping[int, Float[np.ndarray, " S"]], shift: float, style: Style, label: str
) -> None:
    counts = sorted(seeds)
    spreads = [spread(seeds[count]) for count in counts]
    places = np.log2(counts) + shift
    axes.errorbar(
        places,
        [each.mean for each in spreads],
        np.nan_to_num([each.deviation for each in spreads]),
        linewidth=0.8,
        linestyle=":",
        markersize=4,
        capsize=2,
        color=style.color,
        marker=style.marker,
        label=label,
    )
    for place, count in zip(places, counts, strict=True):
        _dots(axes, np.full(len(seeds[count]), place), seeds[count])


def _dots(axes: "Axes", across: Float[np.ndarray, " S"], up: Float[np.ndarray, " S"]) -> None:
    axes.plot(
        across, up, "o", markersize=1.7, color="white", markeredgecolor="black", markeredgewidth=0.4,
        clip_on=False, zorder=4,
    )  # fmt: skip
