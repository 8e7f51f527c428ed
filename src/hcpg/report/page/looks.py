"""The pictures' colours and markers on a screen: as in print, but to be read on white and on black."""

from collections.abc import Sequence

from hcpg.report.styles import styles_of

_ON_WHITE = {"#F0E442": "#A39A00", "#999999": "#7A7A7A", "#56B4E9": "#2F93CC"}
"""Print colours that are too pale for thin lines on a screen."""
_ON_BLACK = {
    "#0072B2": "#4AA8E8",
    "#000000": "#FFFFFF",
    "#D55E00": "#F58A4B",
    "#009E73": "#2CC69A",
    "#999999": "#B4B4B4",
    "#CC79A7": "#E59CC5",
}
_SHAPES = ("circle", "square", "up", "diamond", "down", "cross")
_MARKERS = {"o": "circle", "s": "square", "^": "up", "v": "down", "D": "diamond", "X": "cross"}


def looks(presets: Sequence[str]) -> dict[str, dict[str, str]]:
    """By preset: the colour `on_white`, the one `on_black`, and the marker's `shape`.

    Raises:
        StyleError: more presets than can be told apart.
    """
    return {
        preset: {
            "on_white": _ON_WHITE.get(style.color, style.color),
            "on_black": _ON_BLACK.get(style.color, style.color),
            "shape": _MARKERS.get(str(style.marker), _SHAPES[place % len(_SHAPES)]),
        }
        for place, (preset, style) in enumerate(styles_of(presets).items())
    }
