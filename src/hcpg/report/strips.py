"""Rollout strips: keyframes of a successful episode in one picture, and those of all tasks in a figure.

Source: paper, the figure of representative successful simulation rollouts.
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hcpg.report.extras import require
from hcpg.report.paper_tables import task_name
from hcpg.report.rollouts import Moment, Rollout
from hcpg.report.styles import PAGE_IN, blank, drawing
from hcpg.types import UInt8

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KEYFRAMES = 6
SUFFIX = ".strip.png"
FIRST = "hcpg_flow"
"""The preset whose episode is shown where several have one."""
CAPTION = (
    "Successful evaluation episodes, a row per task: pictures evenly spaced from the first step to the first "
    "success, with the step below each. {episodes}."
)
_FACTS = "hcpg strip"
_LABEL_IN, _TEXT_IN = 0.16, 0.13


class StripError(ValueError):
    """An episode without success or pictures; the message says what to do."""


class Strip(NamedTuple):
    """The keyframes of one episode."""

    pictures: UInt8[np.ndarray, "N H W 3"]
    ticks: list[int]
    """Steps before each picture."""
    task: str
    preset: str
    title: str
    """Which episode it is, in words."""


def keyframes(rollout: Rollout, count: int = KEYFRAMES) -> list[Moment]:
    """Up to `count` moments with a picture, evenly spaced from the first to the first after the success.

    Raises:
        StripError: the episode has no success, or no pictures.
    """
    end = rollout.success_tick
    if end is None:
        raise StripError(f"no success to show ({rollout.title}). Play more --episodes, or train on.")
    seen = [moment for moment in rollout.moments if moment.picture is not None]
    until = [moment for moment in seen if moment.tick <= end] + [m for m in seen if m.tick > end][:1]
    if not until:
        raise StripError(f"the episode has no pictures ({rollout.title}). Play it again.")
    places = np.linspace(0, len(until) - 1, min(count, len(until))).round().astype(int)
    return [until[place] for place in places]


def write_strip(rollout: Rollout, path: Path) -> Path:
    """The keyframes side by side as a PNG file, which holds what `read_strip` needs.

    Raises:
        StripError: the episode has no success, or no pictures.
        MissingExtraError: Pillow is not installed.
    """
    require("PIL", "plots")
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    moments = keyframes(rollout)
    pictures = [moment.picture for moment in moments if moment.picture is not None]
    ticks = [moment.tick for moment in moments]
    facts = {"ticks": ticks, "task": rollout.task, "preset": rollout.preset, "title": rollout.title}
    inside = PngInfo()
    inside.add_text(_FACTS, json.dumps(facts))
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.concatenate(pictures, axis=1)).save(path, pnginfo=inside)
    return path


def read_strip(path: Path) -> Strip:
    """The strip that `write_strip` wrote.

    Raises:
        StripError: the file is another picture.
    """
    from PIL import Image

    with Image.open(path) as picture:
        facts, pixels = json.loads(getattr(picture, "text", {}).get(_FACTS, "{}")), np.asarray(picture)
    if not facts:
        raise StripError(f"{path} holds no strip. Make it anew: hcpg play RUN --strip")
    pictures = np.stack(np.split(pixels, len(facts["ticks"]), axis=1))
    return Strip(pictures, **facts)


def find_strips(runs: Iterable[Path]) -> list[Path]:
    """The newest strip of every run that has one, in its `videos/`."""
    found = [sorted((run / "videos").glob(f"*{SUFFIX}"))[-1:] for run in runs]
    return [path for each in found for path in each]


def rollout_strips(strips: Sequence[Strip]) -> "Figure":
    """A row per strip, a page wide.

    Raises:
        ValueError: no strips.
    """
    if not strips:
        raise ValueError("no strips to draw. Make some: hcpg play RUN --strip")
    heights = [(PAGE_IN - _LABEL_IN) / KEYFRAMES * _aspect(strip) + _TEXT_IN for strip in strips]
    with drawing():
        figure = blank(PAGE_IN, sum(heights))
        figure.set_layout_engine("none")  # every size is known
        top = sum(heights)
        for strip, height in zip(strips, heights, strict=True):
            top -= height
            _row(figure, strip, (top + _TEXT_IN) / sum(heights), (height - _TEXT_IN) / sum(heights))
    return figure


def _aspect(strip: Strip) -> float:
    return strip.pictures.shape[1] / strip.pictures.shape[2]


def _row(figure: "Figure", strip: Strip, bottom: float, height: float) -> None:
    left, width = _LABEL_IN / PAGE_IN, (1 - _LABEL_IN / PAGE_IN) / KEYFRAMES
    for place, (picture, tick) in enumerate(zip(strip.pictures, strip.ticks, strict=True)):
        axes = figure.add_axes((left + place * width + 0.001, bottom, width - 0.002, height))
        axes.imshow(picture, aspect="auto", interpolation="antialiased")
        axes.set_axis_off()
        middle = left + (place + 0.5) * width
        figure.text(middle, bottom - 0.004, f"step {tick}", ha="center", va="top", fontsize=6.5)
    name = task_name(strip.task)
    figure.text(left / 2, bottom + height / 2, name, rotation=90, ha="center", va="center", fontsize=7.5)
