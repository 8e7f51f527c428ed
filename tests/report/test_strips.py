"""Strips: which pictures are kept, that they come back from the file, and how they are laid out."""

import numpy as np
import pytest
from rollout_cases import rollout

from hcpg.report.paper_figures import strips_of
from hcpg.report.records import load_runs
from hcpg.report.strips import (
    StripError,
    find_strips,
    keyframes,
    read_strip,
    rollout_strips,
    write_strip,
)
from hcpg.report.styles import PAGE_IN


def test_keyframes_are_even_and_end_just_after_the_success():
    long = rollout(success_tick=20, length=40)
    assert [moment.tick for moment in keyframes(long)] == [0, 4, 8, 13, 17, 21]
    assert [moment.tick for moment in keyframes(rollout())] == [0, 1, 2, 3, 4, 5]
    sparse = long._replace(
        moments=[m if m.tick % 10 == 0 else m._replace(picture=None) for m in long.moments]
    )
    assert [moment.tick for moment in keyframes(sparse)] == [0, 10, 20, 30]


def test_without_success_or_pictures_there_is_none():
    with pytest.raises(
        StripError, match=r"no success to show \(metaworld/drawer-open, hcpg_flow seed 1 at step 5,000"
    ):
        keyframes(rollout(success_tick=None))
    blind = rollout()
    with pytest.raises(StripError, match="has no pictures"):
        keyframes(blind._replace(moments=[moment._replace(picture=None) for moment in blind.moments]))


def test_a_strip_comes_back_from_its_file(tmp_path):
    path = write_strip(rollout(), tmp_path / "run" / "videos" / "step_1.strip.png")
    strip = read_strip(path)
    assert strip.pictures.shape == (6, 8, 12, 3)
    assert [int(picture.mean()) for picture in strip.pictures] == [0, 5, 10, 15, 20, 25]
    assert (strip.ticks, strip.task, strip.preset) == (
        [0, 1, 2, 3, 4, 5],
        "metaworld/drawer-open",
        "hcpg_flow",
    )
    assert "start state 3" in strip.title
    assert find_strips([tmp_path / "run", tmp_path / "other"]) == [path]


def test_another_picture_is_refused(tmp_path):
    from PIL import Image

    Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(StripError, match=r"a.png holds no strip. Make it anew: hcpg play RUN --strip"):
        read_strip(tmp_path / "a.png")


def test_the_figure_has_a_row_per_strip_and_keeps_proportions(tmp_path):
    strip = read_strip(write_strip(rollout(), tmp_path / "a.strip.png"))
    figure = rollout_strips([strip, strip._replace(task="metaworld/lever-pull")])
    assert figure.get_size_inches()[0] == PAGE_IN
    assert len(figure.axes) == 12
    words = [each.get_text() for each in figure.texts]
    assert [word for word in words if not word.startswith("step")] == ["DrawerOpen", "LeverPull"]
    assert words[:6] == [f"step {tick}" for tick in range(6)]
    box = figure.axes[0].get_position()
    width, height = figure.get_size_inches()
    # Pictures are 12 wide and 8 high.
    assert box.height * height / (box.width * width) == pytest.approx(8 / 12, rel=0.03)
    with pytest.raises(ValueError, match="hcpg play RUN --strip"):
        rollout_strips([])


def test_the_report_takes_one_strip_per_task_ours_first(write_run):
    for preset, start in (("sac_flow", 1), ("hcpg_flow", 2)):
        path = write_run(preset=preset, bare=[1] * 5)
        write_strip(rollout()._replace(preset=preset, start=start), path / "videos" / "a.strip.png")
    [(group, strip)] = strips_of(load_runs([path.parents[2]]))
    assert (group.preset, strip.preset) == ("hcpg_flow", "hcpg_flow")
    assert strip.title.endswith("start state 2")
