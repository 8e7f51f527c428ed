"""Learning curves: success over environment steps, with the selector (solid) and bare (dashed)."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hcpg.report.extras import require
from hcpg.report.records import BARE, Curve, Group
from hcpg.report.statistics import wilson

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class _Style(NamedTuple):
    color: str
    marker: str


# Okabe and Ito's colours, in an order whose brightness differs, so that they part in grey too.
_STYLES = (
    _Style("#0072B2", "o"),
    _Style("#E69F00", "s"),
    _Style("#000000", "^"),
    _Style("#CC79A7", "D"),
    _Style("#009E73", "v"),
    _Style("#56B4E9", "P"),
    _Style("#D55E00", "X"),
)


def learning_curves(groups: Sequence[Group], stem: Path) -> tuple[Path, Path]:
    """Draw one panel per task and write `stem`.png and `stem`.svg; gives both paths.

    A thick line is the mean over seeds, thin ones are the seeds with the selector; a single seed gets the
    95 % Wilson band of its episodes instead.

    Raises:
        MissingExtraError: matplotlib is not installed.
        ValueError: more presets than can be told apart.
    """
    require("matplotlib", "plots")
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    styles = _styles(groups)
    tasks = sorted({group.task for group in groups})
    # A fixed salt: the same numbers give the same SVG, byte for byte.
    with rc_context({"svg.hashsalt": "hcpg", "font.size": 9}):
        figure = Figure(figsize=(1 + 4.4 * len(tasks), 4.2), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(1, len(tasks), sharey=True, squeeze=False)[0]
        for panel, task in zip(panels, tasks, strict=True):
            _panel(panel, [group for group in groups if group.task == task], styles)
        panels[0].set_ylabel("evaluation episodes with success, %")
        _legend(figure, panels, groups)
        stem.parent.mkdir(parents=True, exist_ok=True)
        png, svg = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.svg")
        figure.savefig(png, dpi=160)
        figure.savefig(svg, metadata={"Date": None})
    return png, svg


def _legend(figure: "Figure", panels: Iterable["Axes"], groups: Sequence[Group]) -> None:
    lines = {str(line.get_label()): line for panel in panels for line in panel.get_legend_handles_labels()[0]}
    several = {len(group.runs) > 1 for group in groups}
    notes = {True: "thick: mean over seeds, thin: each seed", False: "band: 95 % Wilson interval of one seed"}
    title = "; ".join(notes[kind] for kind in sorted(several, reverse=True))
    figure.legend(
        lines.values(), lines.keys(), title=title, loc="outside lower center", ncols=2, frameon=False
    )


def _styles(groups: Sequence[Group]) -> dict[str, _Style]:
    presets = list(dict.fromkeys(group.preset for group in groups))
    if len(presets) > len(_STYLES):
        raise ValueError(
            f"{len(presets)} presets in one picture, at most {len(_STYLES)} can be told apart; draw fewer"
        )
    return dict(zip(presets, _STYLES, strict=False))


def _panel(panel: "Axes", groups: Sequence[Group], styles: dict[str, _Style]) -> None:
    for group in groups:
        _line(panel, group, group.selector, styles[group.preset])
        if group.selector != BARE:
            _line(panel, group, BARE, styles[group.preset])
    panel.set_title(groups[0].task)
    panel.set_xlabel("environment steps")
    panel.xaxis.set_major_formatter(lambda value, _place: f"{value:,.0f}")
    panel.set_ylim(-4, 104)
    panel.set_xlim(left=0)
    panel.grid(color="0.9", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def _line(panel: "Axes", group: Group, selector: str, style: _Style) -> None:
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
        markersize=4,
        linewidth=1.4 if bare else 2.0,
        label=label,
        clip_on=False,
    )
    if bare:
        return
    if len(group.runs) > 1:
        panel.plot(curve.steps, 100 * curve.rates.T, color=style.color, linewidth=0.7, alpha=0.6)
    else:
        _band(panel, curve, style)


def _band(panel: "Axes", curve: Curve, style: _Style) -> None:
    counts = zip(curve.successes[0].tolist(), curve.episodes[0].tolist(), strict=True)
    bounds = 100 * np.array([wilson(successes, episodes) for successes, episodes in counts])
    panel.fill_between(curve.steps, bounds[:, 0], bounds[:, 1], color=style.color, alpha=0.15, linewidth=0)
