"""Demonstrations, recorded on the point arm and read back; and what is refused."""

import json
from contextlib import nullcontext

import numpy as np
import pytest
from point_rig import new_rig
from test_control_episodes import greedy

from hcpg.loops import demonstrations, recording
from hcpg.loops.control.episodes import DRAWS_PER_EPISODE
from hcpg.loops.demonstrations import DemonstrationError
from hcpg.loops.recording import FIRST_START, NOISE, SPEEDS, Expert, Order, Paced, Source
from hcpg.robots.point import JumpingClock

ORDER = Order("point/reach", "point", "twin", wanted=3, seed=2)
TASK = ORDER.task


def slowed(speed):
    return lambda observation, count, draw: speed * greedy(observation, count, draw)


def record(folder, order=ORDER, source=None):
    rig = new_rig()
    return recording.record(order, rig, source or recording.scripted(slowed, order.seed), folder, "hcpg …")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded") / "demos"
    return folder, record(folder)


def test_what_was_executed_is_what_is_stored(recorded):
    folder, done = recorded
    shown = demonstrations.load(folder, TASK)
    rows = [json.loads(line) for line in (folder / "steps.jsonl").read_text().splitlines()]
    executed = [row["executed"] for row in rows if row["kind"] == "step" and row["executed"]]
    np.testing.assert_array_equal(shown.batch.actions, np.asarray(executed, np.float32))
    assert len(shown.batch.rewards) == sum(each.actions for each in done.episodes)
    assert shown.batch.terminated.sum() == 3.0
    assert [each["start"] for each in shown.manifest["episodes"]] == [
        FIRST_START + 2000 + number for number in range(3)
    ]


def test_the_manifest_says_that_a_script_stood_in_for_a_person(recorded):
    manifest = demonstrations.load(recorded[0], TASK).manifest
    assert manifest["source"]["name"] == "expert"
    assert "in the place of a person" in manifest["source"]["stand_in"]
    assert (manifest["source"]["speeds"], manifest["source"]["noise"]) == (list(SPEEDS), NOISE)
    assert (manifest["robot"], manifest["kind"], manifest["limits"]["step_m"]) == ("point", "twin", 0.02)


def test_demonstrations_of_another_task_are_refused(recorded):
    with pytest.raises(DemonstrationError, match="are of point/reach, not of franka/button-press"):
        demonstrations.load(recorded[0], "franka/button-press")


def test_what_was_altered_is_refused(recorded, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    for file in recorded[0].glob("*"):
        (copy / file.name).write_bytes(file.read_bytes())
    arrays = copy / "episode_001.npz"
    arrays.write_bytes(arrays.read_bytes()[:-1] + b"x")
    with pytest.raises(DemonstrationError, match=r"episode_001\.npz is missing or was altered"):
        demonstrations.load(copy, TASK)
    manifest = copy / "manifest.json"
    manifest.write_text(manifest.read_text().replace("point/reach", "point/carry"))
    with pytest.raises(DemonstrationError, match=r"manifest\.json was altered"):
        demonstrations.load(copy, "point/carry")


def test_a_folder_with_something_in_it_is_left_alone(recorded):
    with pytest.raises(DemonstrationError, match="is not empty"):
        record(recorded[0])


def test_failures_are_counted_and_not_kept(tmp_path):
    still = Source(nullcontext(lambda observation, count, draw: np.zeros((count, 4))), {"name": "nobody"})
    with pytest.raises(DemonstrationError, match="0 of 4 episodes succeeded, 2 were wanted"):
        record(tmp_path / "none", ORDER._replace(wanted=2), still)
    manifest = json.loads((tmp_path / "none" / "manifest.json").read_text())
    assert (manifest["episodes"], len(manifest["not_kept"])) == ([], 4)
    with pytest.raises(DemonstrationError, match=r"no demonstration in .* succeeded"):
        demonstrations.load(tmp_path / "none", TASK)


def test_the_expert_is_slow_by_the_episode_and_disturbed_by_the_tick():
    told = []

    def tenths(speed):
        told.append(speed)
        return lambda observation, count, draw: np.full((count, 4), 0.1)

    expert = Expert(tenths, seed=0)
    actions = [expert(np.zeros(11), 1, DRAWS_PER_EPISODE * 3 + tick)[0] for tick in range(1000)]
    assert SPEEDS[0] <= told[0] <= SPEEDS[1]
    assert set(told) == {told[0]}
    assert np.std(actions, axis=0) == pytest.approx([NOISE, NOISE, NOISE, 0.0], abs=0.015)
    assert np.mean(actions, axis=0) == pytest.approx([0.1] * 4, abs=0.02)


def test_a_person_gets_real_time():
    clock = JumpingClock()
    paced = Paced(lambda observation, count, draw: np.zeros((count, 3)), 30.0, clock)
    for draw in range(31):
        paced(np.zeros(11), 1, draw)
    assert clock.now_s() == pytest.approx(1.0)
