"""Watching a policy whose steps are known on paper: what is shown, counted and recorded."""

import os
from dataclasses import replace

import numpy as np
import pytest
from jax import numpy as jnp
from stand_ins import Reacher, Scalar

from hcpg import cli, presets, registry
from hcpg.loops.playing import PlayError, play
from hcpg.loops.streams import EVALUATION_SEED
from hcpg.loops.trained import Trained
from hcpg.report.strips import read_strip
from hcpg.suites.point import optimal_steps

TASK = registry.task("point/reach")


def trained(folder, level=0.0, name="hcpg"):
    """The stand-in as a run: at level 0 it moves straight to the object, at 1 not at all."""
    settings = presets.settings("point/reach", "hcpg_flow", "cpu")
    settings = replace(settings, evaluation_selector=replace(settings.evaluation_selector, candidates=3))
    states = Scalar(jnp.array([level]), jnp.int32(0))
    return Trained(folder, 5, settings, name, Reacher(), TASK.adapters["paper"], states, 400)


@pytest.fixture(scope="module")
def played(tmp_path_factory, straight):
    folder = tmp_path_factory.mktemp("played")
    return play(trained(straight[0]), 2, folder / "a.mp4", folder / "a.rrd"), folder


def test_the_first_success_is_shown_with_its_thoughts(played):
    found, _ = played
    environment = registry.suite("point").make(TASK, EVALUATION_SEED)
    first = environment.reset(0)
    assert found.successes == [True, True]
    assert (found.shown.start, found.shown.success_tick) == (0, optimal_steps(TASK, first) - 1)
    thought = found.shown.moments[0].thought
    assert thought.scene.tool == pytest.approx(first[0:3])
    assert thought.scene.approach == pytest.approx(first[4:7] - first[0:3])
    # All proposals are the same move, so all weigh the same and the blend is it.
    assert thought.weights == pytest.approx([1 / 3] * 3)
    assert found.shown.moments[0].action == pytest.approx(thought.proposals[0])
    assert found.shown.title == ("point/reach, hcpg_flow seed 5 at step 400, selector hcpg, start state 0")


def test_the_recording_has_every_step_of_both_episodes(played):
    from rerun.chunk import RrdReader

    found, folder = played
    rows = [
        chunk.num_rows
        for chunk in RrdReader(folder / "a.rrd").stream().to_chunks()
        if chunk.entity_path == "/selector/scores"
    ]
    environment = registry.suite("point").make(TASK, EVALUATION_SEED)
    # An episode goes on for 20 pictures after its success.
    lengths = [optimal_steps(TASK, environment.reset(start)) + 20 for start in range(2)]
    assert len(found.shown.moments) == lengths[0]
    assert sum(rows) == sum(lengths)


def test_without_success_the_first_episode_is_shown_to_its_limit(tmp_path, straight):
    found = play(trained(straight[0], level=1.0, name="bare"), 2, tmp_path / "a.mp4")
    assert found.successes == [False, False]
    assert (found.shown.start, found.shown.success_tick) == (0, None)
    assert len(found.shown.moments) == TASK.horizon
    assert found.shown.moments[0].thought is None


def test_the_bare_actor_has_nothing_to_record(tmp_path, straight):
    with pytest.raises(PlayError, match=r"selects nothing.*--selector hcpg"):
        play(trained(straight[0], name="bare"), 1, tmp_path / "a.mp4", tmp_path / "a.rrd")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_recording_figure_and_strip(straight, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(os, "environ", os.environ.copy())
    folder, _ = straight
    best = ["--selector", "argmax", "--candidates", "64", "--episodes", "1"]
    asked = ["--rerun", str(tmp_path / "a.rrd"), "--thinking", str(tmp_path / "think.png"), "--strip"]
    assert cli.main(["play", str(folder.path), *best, *asked]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].endswith("argmax.mp4 (success)")
    kinds = ("png", "svg", "pdf", "caption.txt")
    assert printed[1:-1] == [str(tmp_path / "a.rrd"), *(str(tmp_path / f"think.{kind}") for kind in kinds)]
    strip = read_strip(folder.videos / printed[-1].rpartition("/")[2])
    assert (strip.task, strip.preset, strip.ticks[0]) == ("point/reach", "hcpg_flow", 0)
    assert np.ptp(strip.pictures[-1]) > 0
    words = (tmp_path / "think.caption.txt").read_text()
    assert "selector argmax, start state 0" in words
    assert "made by: hcpg play" in words
