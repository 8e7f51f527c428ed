"""Replays of real trials: the expert on the fast twin, and chance on the point arm."""

import json

import numpy as np
import pytest

from hcpg import cli
from hcpg.report.completion_states import completion_figure, last_moment
from hcpg.report.records import RecordError
from hcpg.report.trial_replay import read_trial
from hcpg.robots.point import LIMITS

pytest.importorskip("mujoco")
LINKS = [f"fr3_link{number}" for number in range(8)]


def trials(folder, task, *words):
    command = ["robot", "trials", task, *words, "--unattended", "--trials", "1", "--out", str(folder)]
    assert cli.main(command) == 0
    return next((folder / task).glob("trial_*"))


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """The expert at the button: the shortest of the four tasks."""
    words = ("--robot", "twin", "--policy", "hcpg_flow=expert", "--selector", "hcpg_flow=hcpg")
    return trials(tmp_path_factory.mktemp("twin"), "franka/button-press", *words)


@pytest.fixture(scope="module")
def wandering(tmp_path_factory):
    words = ("--robot", "point", "--policy", "ours=uniform", "--selector", "ours=hcpg")
    return trials(tmp_path_factory.mktemp("point"), "point/reach", *words)


@pytest.fixture(scope="module")
def recording(pressed, tmp_path_factory):
    """Every chunk of the replay, by entity."""
    from rerun.chunk import RrdReader

    path = tmp_path_factory.mktemp("rerun") / "out.rrd"
    assert cli.main(["robot", "replay", str(pressed), "--rerun", str(path)]) == 0
    [found] = RrdReader(path).recordings()
    assert found.application_id == "hcpg robot replay"
    chunks = {}
    for chunk in RrdReader(path).stream().to_chunks():
        chunks.setdefault(chunk.entity_path.removeprefix("/"), []).append(chunk.to_record_batch())
    return chunks


def column(chunks, entity, component):
    return [
        value
        for batch in chunks[entity]
        for name, values in zip(batch.schema.names, batch.columns, strict=True)
        if name.endswith(component)
        for value in values.to_pylist()
    ]


def test_every_entity_is_there(recording):
    assert {f"world/arm/{name}" for name in [*LINKS, "hand", "left_finger", "fixture", "button"]} <= set(
        recording
    )
    assert {
        f"world/{name}" for name in ("tcp", "proposals", "executed", "target", "path", "seen/button")
    } <= set(recording)
    assert {"world/limits/box", "limits/count", "limits/touched", "limits/ramp", "loop/state"} <= set(
        recording
    )
    assert {f"selector/{name}" for name in ("weights", "scores", "phase", "spread")} <= set(recording)
    assert {f"timing/{name}" for name in ("lateness_ms", "policy_ms", "state_age_ms")} <= set(recording)
    assert {"about", "episode/success", "episode/held", "episode/gripper_width_mm"} <= set(recording)


def test_the_hand_stands_where_the_joints_put_it(recording, pressed):
    ticks = read_trial(pressed).ticks
    places = np.array(column(recording, "world/arm/hand", "translation"))[:, 0]
    assert len(places) == len(ticks)
    # The TCP is 103.4 mm from the hand's frame, straight down; logged joints are one 2 ms step ahead of it.
    gaps = places - np.array([tick.position for tick in ticks])
    np.testing.assert_allclose(np.linalg.norm(gaps, axis=1), 0.1034, atol=5e-4)
    assert gaps[:, 2].min() > 0.1025


def test_numbers_are_those_of_the_log(recording, pressed):
    ticks = read_trial(pressed).ticks
    acted = [tick for tick in ticks if tick.chosen is not None]
    # The expert proposes the same four times: nothing to choose between.
    assert column(recording, "selector/weights", "scalars") == [pytest.approx([0.25] * 4)] * len(acted)
    assert column(recording, "episode/success", "scalars") == [[float(tick.success)] for tick in ticks]
    ramped = column(recording, "limits/ramp", "scalars")
    assert [value for [value] in ramped] == [float("ramp" in tick.touched) for tick in ticks]
    assert 0 < sum(value for [value] in ramped) < 10
    target = column(recording, "world/target", "positions")
    assert target[0][0] == pytest.approx(next(tick.target for tick in ticks if tick.target is not None))


def test_an_arm_without_joints_is_replayed_by_its_tool(wandering, tmp_path):
    from rerun.chunk import RrdReader

    path = tmp_path / "out.rrd"
    assert cli.main(["robot", "replay", str(wandering), "--rerun", str(path)]) == 0
    names = {chunk.entity_path.removeprefix("/") for chunk in RrdReader(path).stream().to_chunks()}
    assert {"world/tcp", "world/seen/object", "world/proposals", "selector/phase"} <= names
    assert not any(name.startswith("world/arm") for name in names)


def test_the_log_is_read_back(wandering):
    trial = read_trial(wandering)
    assert trial.title.startswith("point/reach, ours, start state ")
    assert trial.title.endswith(", twin")
    assert trial.box_m[1] == pytest.approx(LIMITS.box_high_m)
    held = [tick for tick in trial.ticks if tick.executed is None]
    assert all(tick.target is None and tick.state != "run" for tick in held)
    acted = next(tick for tick in trial.ticks if tick.executed is not None)
    assert (acted.chosen.proposals.shape, acted.executed.shape) == ((4, 4), (4,))
    assert [tick.number for tick in trial.ticks] == list(range(len(trial.ticks)))
    assert trial.ticks[30].time_s == pytest.approx(1.0)


def test_what_is_no_trial_is_said(tmp_path, wandering):
    with pytest.raises(RecordError, match="is no trial"):
        read_trial(tmp_path)
    (tmp_path / "trial.json").write_text(json.dumps({}))
    with pytest.raises(RecordError, match="no step is in"):
        read_trial(tmp_path)


def test_the_last_moment_is_drawn_and_called_a_twin_s(pressed, tmp_path):
    assert cli.main(["robot", "picture", str(pressed), "--out", str(tmp_path / "done")]) == 0
    assert (tmp_path / "done.png").stat().st_size > 20_000
    told = (tmp_path / "done.caption.txt").read_text()
    assert told.startswith("Completion states (the twin, drawn from its log; no arm moved): (a) the button")


def test_a_trial_that_failed_is_no_completion_state(pressed, wandering):
    trial = read_trial(pressed)
    with pytest.raises(RecordError, match="did not end with the task done"):
        completion_figure([trial._replace(ticks=trial.ticks[:3])])
    with pytest.raises(RecordError, match="cannot be drawn"):
        last_moment(read_trial(wandering))
