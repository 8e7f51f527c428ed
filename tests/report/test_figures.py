"""The picture of learning curves: what is drawn, read back from the SVG and the PNG."""

import re
import sys

import numpy as np
import pytest

from hcpg.report.extras import MissingExtraError
from hcpg.report.figures import _STYLES, learning_curves
from hcpg.report.records import load_runs


@pytest.fixture
def groups(tmp_path, write_run):
    for seed, success in enumerate(([0, 2, 8, 10], [0, 0, 5, 9], [0, 1, 9, 10])):
        write_run(preset="hcpg_flow", seed=seed, success=success, bare=[0, 0, 3, 8])
    write_run(preset="sac_flow", seed=0, bare=[0, 0, 1, 4])
    return load_runs([tmp_path])


def test_lines_bands_and_labels(groups, tmp_path):
    png, svg = learning_curves(groups, tmp_path / "pictures" / "curves")
    assert png.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    text = svg.read_text()
    blue, orange = _STYLES[0].color.lower(), _STYLES[1].color.lower()
    drawn = re.findall(r'<path d="M[^"]*" clip-path="[^"]*" style="fill: none; (stroke[^"]*)"', text)
    # Three seeds with the selector, thin; the means are the only lines that are not clipped.
    assert sum(blue in style for style in drawn) == 3
    # One seed: no thin lines, one band.
    assert sum(orange in style for style in drawn) == 0
    assert text.count(f"fill: {orange}; fill-opacity: 0.15") == 1
    assert text.count(f"fill: {blue}; fill-opacity: 0.15") == 0
    for label in (
        "hcpg_flow (selector hcpg)",
        "hcpg_flow, bare actor",
        "sac_flow",
        "point/reach",
    ):
        assert f"<!-- {label} -->" in text


def test_the_same_numbers_give_the_same_svg(groups, tmp_path):
    first = learning_curves(groups, tmp_path / "a")[1].read_bytes()
    assert learning_curves(groups, tmp_path / "b")[1].read_bytes() == first


def test_neighbouring_colours_differ_in_grey():
    # Rec. 709 luma of the first three styles, the ones a usual picture shows.
    channels = np.array([[int(style.color[k : k + 2], 16) for k in (1, 3, 5)] for style in _STYLES[:3]])
    luma = channels @ [0.2126, 0.7152, 0.0722] / 255
    assert np.diff(sorted(luma)).min() > 0.25


def test_what_cannot_be_drawn_is_said(groups, tmp_path, monkeypatch):
    many = [groups[0]._replace(preset=f"p{k}") for k in range(8)]
    with pytest.raises(ValueError, match="8 presets in one picture, at most 7"):
        learning_curves(many, tmp_path / "many")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"matplotlib is not .*pip install 'hcpg-flow\[plots\]'"):
        learning_curves(groups, tmp_path / "none")
