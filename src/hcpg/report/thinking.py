"""A still picture of the selector's thinking over one episode: proposals, scene, phase, scores, weights."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.rollouts import Moment, Rollout, Thought
from hcpg.report.styles import PAGE_IN, blank, drawing
from hcpg.types import Float, Int

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KEYFRAMES = 5
CAPTION = (
    "The selector's thinking over one episode ({title}). Top: pictures at the numbered steps. Left: the "
    "tool's path (dashed before contact, solid after) in the plane {plane}, with every proposal's "
    "translation at those steps, darker and thicker the larger its weight, and the executed blend in blue; "
    "one unit of action is drawn {unit_m:.2f} m long. Right: the proposals' scores (blue: their mean by "
    "weight), the weights (largest at the bottom), and the distances, over a shaded background where the "
    "contact phase holds."
)
_AXES = "xyz"
_ARROW_SHARE = 0.16
"""Length of one unit of action, as a share of the plane's larger side."""
BLEND, TOOL, OBJECT, GOAL = "#0072B2", "#343A46", "#E69F00", "#009E73"


class ThinkingError(ValueError):
    """An episode without a selector."""


def caption(rollout: Rollout) -> str:
    """What the figure of this episode shows.

    Raises:
        ThinkingError: no selector acted.
    """
    across, up = plane(rollout)
    return CAPTION.format(title=rollout.title, plane=_AXES[across] + _AXES[up], unit_m=_unit_m(rollout))


def plane(rollout: Rollout) -> tuple[int, int]:
    """The two axes along which tool, object and goal lie furthest apart, as indices of x, y and z.

    Raises:
        ThinkingError: no selector acted.
    """
    points = _points(rollout)
    first, second = sorted(np.argsort(-np.ptp(points, axis=0))[:2].tolist())
    return first, second


def thinking_figure(rollout: Rollout) -> "Figure":
    """A page-wide figure of the episode.

    Raises:
        ThinkingError: no selector acted.
    """
    moments, thoughts = rollout.moments, _thoughts(rollout)
    shown = _shown(moments)
    pictures = any(moment.picture is not None for moment in shown)
    with drawing():
        figure = blank(PAGE_IN, 4.3 if pictures else 2.9)
        rows = [0.55, 1.0] if pictures else [1.0]
        parts = figure.subfigures(len(rows), 1, height_ratios=rows, squeeze=False)[:, 0]
        if pictures:
            _pictures(parts[0].subplots(1, len(shown)), shown)
        left, right = parts[-1].subfigures(1, 2, width_ratios=[1.0, 1.5])
        _plan(left.subplots(), rollout, thoughts, [moment.tick for moment in shown])
        timelines = right.subplots(3, 1, sharex=True, height_ratios=[1.2, 1, 1])
        _timelines(timelines, moments, thoughts, [moment.tick for moment in shown])
    return figure


def _thoughts(rollout: Rollout) -> list[Thought]:
    thoughts = [moment.thought for moment in rollout.moments if moment.thought is not None]
    if len(thoughts) < len(rollout.moments) or not thoughts:
        raise ThinkingError(f"no selector acted ({rollout.title}). Choose one, e.g. --selector hcpg.")
    return thoughts


def _shown(moments: Sequence[Moment]) -> list[Moment]:
    """Evenly spaced until the first success, with pictures where there are any."""
    end = next((place for place, moment in enumerate(moments) if moment.success), len(moments) - 1)
    until = [moment for moment in moments[: end + 1] if moment.picture is not None] or list(
        moments[: end + 1]
    )
    places = np.linspace(0, len(until) - 1, min(KEYFRAMES, len(until))).round().astype(int)
    return [until[place] for place in places]


def _points(rollout: Rollout) -> Float[np.ndarray, "N 3"]:
    scenes = [thought.scene for thought in _thoughts(rollout)]
    return np.array([point for scene in scenes for point in (scene.tool, scene.object, scene.goal)])


def _unit_m(rollout: Rollout) -> float:
    return _ARROW_SHARE * float(np.ptp(_points(rollout), axis=0).max())


def _pictures(panels: Sequence["Axes"], shown: Sequence[Moment]) -> None:
    for number, (panel, moment) in enumerate(zip(np.ravel(np.asarray(panels)), shown, strict=True), start=1):
        assert moment.picture is not None
        panel.imshow(moment.picture, interpolation="antialiased")
        label = {"ha": "left", "va": "top", "transform": panel.transAxes, "fontsize": 7}
        frame = {"facecolor": "white", "edgecolor": "none", "pad": 1.2, "alpha": 0.85}
        panel.text(0.03, 0.96, f"{number}: step {moment.tick}", bbox=frame, **label)
        panel.set_axis_off()


def _plan(axes: "Axes", rollout: Rollout, thoughts: Sequence[Thought], ticks: Sequence[int]) -> None:
    """The scene in the plane that shows most of it."""
    across, up = plane(rollout)
    tools = np.array([thought.scene.tool for thought in thoughts])[:, [across, up]]
    objects = np.array([thought.scene.object for thought in thoughts])[:, [across, up]]
    goals = np.array([thought.scene.goal for thought in thoughts])[:, [across, up]]
    contact = np.array([thought.phase for thought in thoughts]) >= 0.5
    axes.plot(*tools.T, color=TOOL, linewidth=0.8, linestyle=(0, (4, 2)), label="tool, before contact")
    touching = np.where(contact[:, None], tools, np.nan)
    axes.plot(*touching.T, color=TOOL, linewidth=1.4, label="tool, in contact")
    axes.plot(*objects.T, color=OBJECT, linewidth=1.2, label="object", marker="s", ms=3.5, markevery=[0])
    axes.plot(*goals[:1].T, "*", color=GOAL, markersize=8, markeredgewidth=0, label="goal")
    for number, tick in enumerate(ticks, start=1):
        _arrows(axes, rollout.moments[tick], tools[tick], rollout, number)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.set_xlabel(f"{_AXES[across]}, m")
    axes.set_ylabel(f"{_AXES[up]}, m")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False, columnspacing=1)


def _arrows(
    axes: "Axes", moment: Moment, tool: Float[np.ndarray, " 2"], rollout: Rollout, number: int
) -> None:
    """Every proposal and the blend, from where the tool is."""
    thought, unit_m = moment.thought, _unit_m(rollout)
    assert thought is not None
    start, directions = rollout.translation[0], plane(rollout)
    places = [start + direction for direction in directions]
    look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
    moves = [*thought.proposals[:, places], moment.action[places]]
    largest = thought.weights.max()
    for place, move in enumerate(moves):
        blend = place == len(thought.weights)
        share = 1.0 if blend else float(thought.weights[place] / largest)
        color, thick = (BLEND, 1.3) if blend else (str(0.75 * (1 - share)), 0.4 + share)
        props = {**look, "color": color, "linewidth": thick}
        axes.annotate("", _pair(tool + unit_m * move), _pair(tool), arrowprops=props, zorder=3 + blend)
    look = {"textcoords": "offset points", "fontsize": 7, "fontweight": "bold"}
    axes.annotate(str(number), _pair(tool), (-6, 5), zorder=5, **look)


def _pair(point: Float[np.ndarray, " 2"]) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _timelines(
    panels: Sequence["Axes"], moments: Sequence[Moment], thoughts: Sequence[Thought], ticks: Sequence[int]
) -> None:
    steps = np.array([moment.tick for moment in moments])
    phases = np.array([thought.phase for thought in thoughts])
    _scores(panels[0], steps, thoughts)
    _weights(panels[1], steps, thoughts)
    _distances(panels[2], steps, thoughts)
    for panel in panels:
        low, high = panel.get_ylim()
        panel.fill_between(
            steps, low, high, where=(phases >= 0.5).tolist(), color="0.9", step="mid", zorder=0, linewidth=0
        )
        panel.set_ylim(low, high)
        panel.set_xlim(steps[0], max(steps[-1], 1))
        for number, tick in enumerate(ticks, start=1):
            panel.axvline(tick, color="0.55", linewidth=0.5, linestyle=":", zorder=1)
            if panel is panels[0]:
                panel.annotate(
                    str(number), (tick, high), ha="center", va="bottom", fontsize=7, fontweight="bold"
                )
    success = next((moment.tick for moment in moments if moment.success), None)
    if success is not None:
        panels[2].axvline(success, color=GOAL, linewidth=1.2, label="first success")
    panels[2].legend(loc="best", frameon=False, ncols=3)
    panels[2].set_xlabel("step of the episode (shaded: contact phase)")


def _scores(panel: "Axes", steps: Int[np.ndarray, " T"], thoughts: Sequence[Thought]) -> None:
    """A dot per proposal: proposals have no order, so no line joins them."""
    scores = np.array([thought.scores for thought in thoughts])
    weights = np.array([thought.weights for thought in thoughts])
    shade = weights / weights.max(axis=1, keepdims=True)
    across = np.broadcast_to(steps[:, None], scores.shape)
    color = (0.8 * (1 - shade)).ravel()
    panel.scatter(across.ravel(), scores.ravel(), 3, color, cmap="gray", vmin=0, vmax=1, linewidths=0)
    blended = (weights * scores).sum(axis=1)
    panel.plot(steps, blended, color=BLEND, linewidth=0.9)
    panel.set_ylabel("score")


def _weights(panel: "Axes", steps: Int[np.ndarray, " T"], thoughts: Sequence[Thought]) -> None:
    weights = -np.sort(-np.array([thought.weights for thought in thoughts]), axis=1)
    shades = [str(0.15 + 0.7 * place / max(weights.shape[1] - 1, 1)) for place in range(weights.shape[1])]
    panel.stackplot(steps, weights.T, colors=shades, linewidth=0)
    panel.set_ylim(0, 1)
    panel.set_ylabel("weights")


def _distances(panel: "Axes", steps: Int[np.ndarray, " T"], thoughts: Sequence[Thought]) -> None:
    approach = [np.linalg.norm(thought.scene.approach) for thought in thoughts]
    task = [np.linalg.norm(thought.scene.task) for thought in thoughts]
    panel.plot(steps, approach, color=TOOL, linewidth=1, linestyle="--", label="approach")
    panel.plot(steps, task, color=OBJECT, linewidth=1.2, label="task")
    panel.set_ylim(bottom=0)
    panel.set_ylabel("distance, m")
