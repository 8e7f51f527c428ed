"""Presets keep their look from picture to picture, and can be told apart in grey and without colour."""

import itertools

import pytest

from hcpg.report.styles import _OTHERS, _PAPER, PAGE_IN, StyleError, blank, drawing, styles_of


def luma(color):
    """Rec. 709."""
    red, green, blue = (int(color[place : place + 2], 16) / 255 for place in (1, 3, 5))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_a_method_looks_the_same_whatever_is_beside_it():
    alone, among = styles_of(["sac_flow"]), styles_of(["x", "hcpg_flow", "y", "sac_flow"])
    assert alone["sac_flow"] == among["sac_flow"]
    assert among["x"] != among["y"]


def test_no_two_share_marker_or_both_grey_and_hatch():
    every = [*_PAPER.values(), *_OTHERS]
    assert len({style.marker for style in every}) == len(every)
    for one, other in itertools.combinations(_PAPER.values(), 2):
        assert one.hatch != other.hatch
        assert one.line != other.line
    for one, other in itertools.combinations(every, 2):
        assert one.hatch != other.hatch or abs(luma(one.color) - luma(other.color)) > 0.1, (one, other)


def test_ours_is_darker_than_its_backbone():
    assert luma(_PAPER["sac_flow"].color) - luma(_PAPER["hcpg_flow"].color) > 0.25


def test_too_many_presets_are_refused():
    assert len(styles_of(f"p{k}" for k in range(12))) == 12
    with pytest.raises(StyleError, match="13 presets beside the paper's in one picture, at most 12"):
        styles_of(f"p{k}" for k in range(13))


def test_a_figure_has_exactly_the_printed_width(tmp_path):
    from PIL import Image

    with drawing():
        blank(PAGE_IN, 2.0).savefig(tmp_path / "a.png", dpi=100)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (716, 200)
