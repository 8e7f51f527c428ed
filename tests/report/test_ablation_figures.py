"""The ablation's pictures: means, whiskers and dots, read back from the figures."""

import numpy as np
import pytest

from hcpg.report.ablation import ablated
from hcpg.report.ablation_figures import ablation_figure, candidates_figure
from hcpg.report.records import load_runs
from hcpg.report.styles import COLUMN_IN


@pytest.fixture
def groups(tmp_path, write_run):
    rates = {"sac_flow": (4, 4), "hcpg_k2": (5, 7), "hcpg_flow": (8, 10)}
    for preset, by_seed in rates.items():
        for seed, rate in enumerate(by_seed):
            for task, less in (("pick-cube", 0), ("push-cube", 2)):
                success = [rate - less] * 5
                write_run(preset=preset, seed=seed, task=f"maniskill/{task}", success=success, bare=[0] * 5)
    return load_runs([tmp_path])


def test_a_row_per_variant_with_the_sd_over_seeds(groups):
    figure = ablation_figure(ablated(groups))
    assert figure.get_size_inches()[0] == COLUMN_IN
    assert [panel.get_title() for panel in figure.axes] == ["Last-5, %", "AUC, %", "Final, %"]
    assert {panel.get_xlim() for panel in figure.axes} == {figure.axes[0].get_xlim()}
    panel = figure.axes[0]
    assert [text.get_text() for text in panel.get_yticklabels()] == ["SAC-Flow", "HCPG K=2", "HCPG K=4"]
    bars = panel.containers[1]
    assert [bar.get_width() for bar in bars] == pytest.approx([30, 50, 80])
    [whiskers] = bars.errorbar.lines[2]
    spans = [np.ptp(segment[:, 0]) / 2 for segment in whiskers.get_segments()]
    # Seeds' means over tasks: 30, 30; 40, 60; 70, 90.
    assert spans == pytest.approx([0, 200**0.5, 200**0.5])


def test_success_over_k_by_task_and_its_mean(groups):
    [axes] = candidates_figure(groups).axes
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines["mean over tasks"].get_xdata()) == [0, 1, 2]
    assert list(lines["mean over tasks"].get_ydata()) == pytest.approx([30, 50, 80])
    assert [text.get_text() for text in axes.get_xticklabels()] == ["1", "2", "4"]
    assert list(axes.get_yticks()) == [0, 25, 50, 75, 100]
    pick = next(each for each in axes.containers if each.get_label() == "PickCube")
    assert list(pick.lines[0].get_ydata()) == pytest.approx([40, 60, 90])
