"""The figure of the selector's thinking: what is drawn, read back from it."""

import numpy as np
import pytest
from rollout_cases import rollout

from hcpg.report.styles import PAGE_IN
from hcpg.report.thinking import ThinkingError, caption, plane, thinking_figure


def panels(figure):
    return [axes for part in figure.subfigs for axes in part.axes] + [
        axes for part in figure.subfigs for inner in part.subfigs for axes in inner.axes
    ]


def test_scores_weights_distances_phase_and_success():
    figure = thinking_figure(rollout())
    assert figure.get_size_inches()[0] == PAGE_IN
    *pictures, _, scores, weights, distances = panels(figure)
    assert len(pictures) == 5
    [dots] = [each for each in scores.collections if len(each.get_offsets()) == 24]
    assert dots.get_offsets()[:4].tolist() == [[0, 0.9], [0, 0.4], [0, 0.0], [0, -1.0]]
    # 0.6 * 0.9 + 0.3 * 0.4 + 0.06 * 0 - 0.04 * 1
    assert scores.lines[0].get_ydata() == pytest.approx([0.62] * 6)
    assert weights.get_ylim() == (0, 1)
    assert weights.collections[0].get_paths()[0].get_extents().ymax == pytest.approx(0.6)
    approach = next(line for line in distances.lines if line.get_label() == "approach")
    assert approach.get_ydata()[:4] == pytest.approx([np.hypot(0.3 - 0.1 * tick, 0.1) for tick in range(4)])
    success = next(line for line in distances.lines if line.get_label() == "first success")
    assert success.get_xdata()[0] == 4
    # Contact begins at step 3.
    shaded = scores.collections[-1].get_paths()[0].get_extents()
    assert (shaded.xmin, shaded.xmax) == (3, 5)


def test_the_plan_shows_the_tools_path_in_the_widest_plane():
    # x spans 0.5, y 0.1 and z 0.1: the first of equals.
    assert plane(rollout()) == (0, 1)
    plan = panels(thinking_figure(rollout()))[5]
    assert plan.lines[0].get_xdata() == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5])
    arrows = [each for each in plan.texts if each.arrow_patch is not None]
    assert len(arrows) == 5 * 5
    # The first keyframe's blend: (0.7, 0.1) times 0.16 of the largest extent, 0.5 m.
    assert arrows[4].xyann == pytest.approx((0, 0))
    assert arrows[4].xy == pytest.approx((0.056, 0.008))
    assert "plane xy" in caption(rollout())
    assert "drawn 0.08 m long" in caption(rollout())


def test_pictures_may_lack():
    blind = rollout()
    blind = blind._replace(moments=[moment._replace(picture=None) for moment in blind.moments])
    assert len(panels(thinking_figure(blind))) == 4


def test_without_a_selector_there_is_nothing_to_see():
    with pytest.raises(ThinkingError, match=r"no selector acted .*--selector hcpg"):
        thinking_figure(rollout(selects=False))
