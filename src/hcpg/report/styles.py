"""How pictures look: IEEE column widths, and per preset a look that grey print and colour-blind eyes part."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from hcpg.report.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN_IN, PAGE_IN = 3.5, 7.16
"""Widths of one column and of the whole page in IEEE's journals, inches."""
_RC = {
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.title_fontsize": 7,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "hatch.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    # A fixed salt: the same numbers give the same SVG, byte for byte. Fonts as outlines LaTeX can embed.
    "svg.hashsalt": "hcpg",
    "pdf.fonttype": 42,
}


class StyleError(ValueError):
    """More presets than can be told apart in one picture."""


class Style(NamedTuple):
    """The look of one preset, in every picture."""

    color: str
    marker: str | tuple[int, int, int]
    hatch: str
    """Of its bars; empty is solid."""
    line: str | tuple[int, tuple[int, ...]]
    """Of its curve where a line stands for nothing else."""


# Okabe and Ito's colours. The baselines' order follows the paper's columns; ours is dark and without a hatch.
_PAPER = {
    "sac": Style("#999999", "^", "....", ":"),
    "flowrl": Style("#009E73", "v", "\\\\\\\\", "-."),
    "qsm": Style("#CC79A7", "D", "xxxx", (0, (5, 1, 1, 1, 1, 1))),
    "sac_flow": Style("#E69F00", "s", "////", "--"),
    "hcpg_flow": Style("#0072B2", "o", "", "-"),
}
_OTHERS = (
    Style("#56B4E9", "P", "||||", "-"),
    Style("#D55E00", "X", "----", ":"),
    Style("#000000", "<", "", ":"),
    Style("#F0E442", ">", "++++", "-"),
    Style("#56B4E9", "h", "oo", "-"),
    Style("#D55E00", "p", "OO", "-"),
    Style("#009E73", "d", "//", "--"),
    Style("#CC79A7", "8", "||", ":"),
    Style("#999999", "*", "--", "-"),
    Style("#F0E442", "H", "\\\\", "-."),
    Style("#0072B2", (4, 1, 45), "..", "--"),
    Style("#E69F00", (6, 1, 0), "**", "-."),
)


def styles_of(presets: Iterable[str]) -> dict[str, Style]:
    """A style for every preset: the paper's methods have their own, the others take turns in order.

    Raises:
        StyleError: there are more others than styles.
    """
    names = list(dict.fromkeys(presets))
    others = [name for name in names if name not in _PAPER]
    if len(others) > len(_OTHERS):
        raise StyleError(
            f"{len(others)} presets beside the paper's in one picture, at most {len(_OTHERS)} can be told "
            "apart; draw fewer"
        )
    return {name: _PAPER[name] if name in _PAPER else _OTHERS[others.index(name)] for name in names}


@contextmanager
def drawing() -> Iterator[None]:
    """Draw and save inside this: fonts, lines and hatches of a printed column.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("matplotlib", "plots")
    from matplotlib import RcParams, rc_context

    with rc_context(RcParams(_RC)):
        yield


def blank(width_in: float, height_in: float) -> "Figure":
    """An empty figure of exactly that size, laid out so that nothing overlaps."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02)
    figure = Figure(figsize=(width_in, height_in), layout=layout)
    FigureCanvasAgg(figure)
    return figure
