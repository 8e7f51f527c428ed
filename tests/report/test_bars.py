"""Bars of last-five success: heights, whiskers, dots and the shaded average, read back from the figure."""

import numpy as np
import pytest

from hcpg.report.bars import AVERAGE, ordered, seeds_last_five, success_bars, suites_of
from hcpg.report.records import RecordError, load_runs
from hcpg.report.styles import COLUMN_IN, PAGE_IN


@pytest.fixture
def groups(tmp_path, write_run):
    """SAC-Flow on two tasks; HCPG-Flow on one only."""
    for seed, rate in enumerate((0, 0, 10)):
        write_run(preset="sac_flow", task="metaworld/drawer-open", seed=seed, bare=[10, *[rate] * 5])
        write_run(preset="sac_flow", task="metaworld/lever-pull", seed=seed, bare=[10, *[8 + seed] * 5])
        write_run(
            preset="hcpg_flow",
            task="metaworld/drawer-open",
            seed=seed,
            success=[0, 6, 7, 8, 9, 10],
            bare=[0] * 6,
        )
    return load_runs([tmp_path])


def test_values_are_those_of_the_last_five_with_the_presets_own_selector(groups):
    values = seeds_last_five(groups)
    assert values["metaworld/drawer-open", "sac_flow"] == pytest.approx([0, 0, 100])
    assert values["metaworld/drawer-open", "hcpg_flow"] == pytest.approx([80, 80, 80])


def test_heights_whiskers_and_dots(groups):
    [axes] = success_bars(groups).axes
    backbone, ours = axes.containers[1], axes.containers[3]
    # DrawerOpen 0, 0, 100; LeverPull 80, 90, 100; their average is shaded.
    assert [bar.get_height() for bar in backbone] == pytest.approx([100 / 3, 90, 185 / 3])
    assert [bar.get_height() for bar in ours] == pytest.approx([80])
    [whiskers] = backbone.errorbar.lines[2]
    spans = [np.ptp(segment[:, 1]) / 2 for segment in whiskers.get_segments()]
    assert spans == pytest.approx([57.735, 10, abs(90 - 100 / 3) / 2**0.5], abs=1e-3)
    dots = sorted(float(y) for line in axes.lines if line.get_marker() == "o" for y in line.get_ydata())
    assert dots == pytest.approx([0, 0, 80, 80, 80, 80, 90, 100, 100])
    assert [text.get_text() for text in axes.get_xticklabels()] == ["DrawerOpen", "LeverPull", AVERAGE]
    # HCPG-Flow has no runs on LeverPull, so no average either: dashes, as in the table.
    assert [text.get_text() for text in axes.texts] == ["–", "–"]


def test_many_bars_take_a_page(groups):
    assert success_bars(groups).get_size_inches()[0] == COLUMN_IN
    many = [groups[0]._replace(preset=f"p{k}", task=f"a/{t}") for k in range(9) for t in range(4)]
    assert success_bars(many).get_size_inches()[0] == PAGE_IN


def test_unlike_protocols_are_refused(write_run, groups, tmp_path):
    write_run(preset="qsm", task="metaworld/drawer-open", bare=[1] * 6)
    with pytest.raises(RecordError, match="cannot mix seeds"):
        success_bars(load_runs([tmp_path]))


def test_order_and_suites(groups):
    assert ordered(["z", "hcpg_flow", "a", "sac"]) == ["sac", "hcpg_flow", "a", "z"]
    assert {name: len(own) for name, own in suites_of(groups).items()} == {"metaworld": 3}
