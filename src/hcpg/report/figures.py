"""Learning curves: success over environment steps, with the selector (solid) and bare (dashed)."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.records import BARE, Curve, Group
from hcpg.report.statistics import wilson
from hcpg.report.styles import COLUMN_IN, PAGE_IN, Style, blank, drawing, styles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CAPTION = (
    "Success over environment steps, with the preset's selector (solid) and of the bare actor (dashed). A "
    "thick line is the mean over seeds, thin lines are the seeds with the selector; a single seed has the "
    "95 % Wilson band of its episodes instead."
)
ROW_PANELS = 3


def learning_curves(groups: Sequence[Group]) -> "Figure":
    """A panel per task, one column wide for a single task, else a page.

    Raises:
        MissingExtraError: matplotlib is not installed.
        StyleError: more presets than can be told apart.
    """
    styles = styles_of(group.preset for group in groups)
    tasks = sorted({group.task for group in groups})
    columns = min(len(tasks), ROW_PANELS)
    rows = -(-len(tasks) // columns)
    with drawing():
        figure = blank(COLUMN_IN if len(tasks) == 1 else PAGE_IN, 0.7 + 1.9 * rows)
        panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
        for panel, task in zip(panels, tasks, strict=False):
            _panel(panel, [group for group in groups if group.task == task], styles)
        for panel in panels[len(tasks) :]:
            panel.set_visible(False)
        for panel in panels[::columns]:
            panel.set_ylabel("evaluation episodes\nwith success, %")
        _legend(figure, panels[: len(tasks)], 2 * columns)
    return figure


def _legend(figure: "Figure", panels: Iterable["Axes"], columns: int) -> None:
    lines = {str(line.get_label()): line for panel in panels for line in panel.get_legend_handles_labels()[0]}
    figure.legend(
        lines.values(), lines.keys(), loc="outside lower center", ncols=min(columns, 4), frameon=False
    )


def _panel(panel: "Axes", groups: Sequence[Group], styles: dict[str, Style]) -> None:
    for group in groups:
        _line(panel, group, group.selector, styles[group.preset])
        if group.selector != BARE:
            _line(panel, group, BARE, styles[group.preset])
    panel.set_title(groups[0].task)
    panel.set_xlabel("environment steps")
    panel.xaxis.set_major_formatter(lambda value, _place: f"{value:,.0f}")
    panel.locator_params(axis="x", nbins=4)
    panel.set_ylim(-4, 104)
    panel.set_xlim(left=0)
    panel.grid(color="0.9", linewidth=0.6)


def _line(panel: "Axes", group: Group, selector: str, style: Style) -> None:
    curve = group.curve(selector)
    if curve is None:
        return
    bare = selector == BARE and group.selector != BARE
    names = {BARE: f"{group.preset}, bare actor" if bare else group.preset}
    label = names.get(selector, f"{group.preset} (selector {selector})")
    panel.plot(
        curve.steps,
        100 * curve.rates.mean(axis=0),
        color=style.color,
        linestyle="--" if bare else "-",
        marker=style.marker,
        markerfacecolor="white" if bare else style.color,
        markersize=3.2,
        linewidth=1.0 if bare else 1.5,
        label=label,
        clip_on=False,
    )
    if bare:
        return
    if len(group.runs) > 1:
        panel.plot(curve.steps, 100 * curve.rates.T, color=style.color, linewidth=0.5, alpha=0.6)
    else:
        _band(panel, curve, style)


def _band(panel: "Axes", curve: Curve, style: Style) -> None:
    counts = zip(curve.successes[0].tolist(), curve.episodes[0].tolist(), strict=True)
    bounds = 100 * np.array([wilson(successes, episodes) for successes, episodes in counts])
    panel.fill_between(curve.steps, bounds[:, 0], bounds[:, 1], color=style.color, alpha=0.15, linewidth=0)
