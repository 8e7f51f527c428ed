"""Learning progress: tasks averaged within each seed at equal shares of the budget."""

import logging

import numpy as np
import pytest

from hcpg.report.learning_progress import profiles, progress_figure
from hcpg.report.records import RecordError, load_runs
from hcpg.report.styles import COLUMN_IN


@pytest.fixture
def groups(tmp_path, write_run):
    """Two evaluations on one task, four on the other; seed 1 is better."""
    for seed in (0, 1):
        write_run(preset="sac_flow", task="point/reach", seed=seed, bare=[2, 4 + 2 * seed])
        write_run(preset="sac_flow", task="point/carry", seed=seed, bare=[0, 4, 6, 8])
    return load_runs([tmp_path])


def test_tasks_are_averaged_within_each_seed_over_the_shared_budget(groups):
    profile = profiles(groups)["sac_flow"]
    # Reach has evaluations at half and all of its budget; before half there is nothing to average.
    assert profile.budget == pytest.approx([0.5, 0.75, 1.0])
    # Seed 0 at three quarters: reach 30 (between 20 and 40), carry 60.
    assert profile.success == pytest.approx(np.array([[30, 45, 60], [30, 50, 70]]))


def test_the_line_is_the_mean_and_the_shade_one_sample_sd(groups):
    figure = progress_figure(groups)
    [panel] = figure.axes
    [line] = panel.lines
    assert line.get_xdata() == pytest.approx([50, 75, 100])
    assert line.get_ydata() == pytest.approx([30, 47.5, 65])
    [shade] = panel.collections
    assert shade.get_paths()[0].get_extents().ymax == pytest.approx(65 + 50**0.5)
    assert figure.get_size_inches()[0] == COLUMN_IN
    assert panel.get_title() == "point"


def test_a_method_that_lacks_a_task_is_left_out_with_a_notice(write_run, groups, tmp_path, caplog):
    write_run(preset="sac", task="point/reach", bare=[1, 2])
    with caplog.at_level(logging.WARNING):
        assert list(profiles(load_runs([tmp_path]))) == ["sac_flow"]
    assert "left sac out of the progress: it lacks point/carry" in caplog.text


def test_nothing_is_drawn_where_every_preset_lacks_a_task(write_run, tmp_path):
    write_run(preset="sac", task="point/reach", bare=[1, 2])
    write_run(preset="qsm", task="point/carry", bare=[1, 2])
    assert progress_figure(load_runs([tmp_path])) is None


def test_unlike_seeds_are_refused(write_run, groups, tmp_path):
    write_run(preset="sac_flow", task="point/carry", seed=2, bare=[1, 2])
    with pytest.raises(RecordError, match=r"different seeds \(\[\(0, 1\), \(0, 1, 2\)\]\)"):
        profiles(load_runs([tmp_path]))
