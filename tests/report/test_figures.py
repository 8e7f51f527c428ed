"""The picture of learning curves: what is drawn, read back from the figure."""

import sys

import pytest

from hcpg.report.extras import MissingExtraError
from hcpg.report.figures import learning_curves
from hcpg.report.records import load_runs
from hcpg.report.styles import COLUMN_IN, PAGE_IN, styles_of


@pytest.fixture
def groups(tmp_path, write_run):
    for seed, success in enumerate(([0, 2, 8, 10], [0, 0, 5, 9], [0, 1, 9, 10])):
        write_run(preset="hcpg_flow", seed=seed, success=success, bare=[0, 0, 3, 8])
    write_run(preset="sac_flow", seed=0, bare=[0, 0, 1, 4])
    return load_runs([tmp_path])


def test_lines_bands_and_labels(groups):
    figure = learning_curves(groups)
    [panel] = figure.axes
    blue, orange = (styles_of(["hcpg_flow", "sac_flow"])[name].color for name in ("hcpg_flow", "sac_flow"))
    named = {line.get_label(): line for line in panel.lines if not line.get_label().startswith("_")}
    assert list(named) == ["hcpg_flow (selector hcpg)", "hcpg_flow, bare actor", "sac_flow"]
    assert named["hcpg_flow (selector hcpg)"].get_ydata() == pytest.approx([0, 10, 220 / 3, 290 / 3])
    assert [line.get_linestyle() for line in named.values()] == ["-", "--", "-"]
    # Three seeds: each has a thin line. One seed: the Wilson band alone; 4 of 10 has [16.8, 68.7].
    thin = [line for line in panel.lines if line.get_label().startswith("_")]
    assert [line.get_color() for line in thin] == [blue] * 3
    [band] = panel.collections
    assert named["sac_flow"].get_color() == orange
    assert band.get_paths()[0].get_extents().ymax == pytest.approx(68.7, abs=0.05)
    assert panel.get_title() == "point/reach"


def test_one_task_takes_a_column_and_four_take_a_page_in_rows(groups):
    assert learning_curves(groups).get_size_inches()[0] == COLUMN_IN
    four = [groups[0]._replace(task=f"point/{k}") for k in range(4)]
    figure = learning_curves(four)
    assert figure.get_size_inches()[0] == PAGE_IN
    assert [panel.get_visible() for panel in figure.axes] == [True] * 4 + [False] * 2


def test_without_matplotlib_the_cure_is_said(groups, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"matplotlib is not .*pip install 'hcpg-flow\[plots\]'"):
        learning_curves(groups)
