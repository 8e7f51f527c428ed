"""Followers pass on what the journal wrote: every complete step once, in order, also after a resume."""

import fcntl
import json

import pytest

from hcpg import cli
from hcpg.loops.child import Message
from hcpg.loops.following import Follower, values_by_step
from hcpg.loops.population import Lane
from hcpg.loops.runs import RunFolder
from hcpg.loops.tracking import TrackedView
from hcpg.report import trackers


class Listener:
    """Takes down what it is told; of every run's listeners the last one is kept."""

    last = None

    def __init__(self, run):
        self.run, self.told, self.closed = run, [], False
        Listener.last = self

    def log(self, step, values):
        self.told.append((step, dict(values)))

    def close(self):
        self.closed = True


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setitem(trackers.TRACKERS, "listener", Listener)
    return RunFolder.create(
        tmp_path, task="point/reach", preset="hcpg_flow", seed=3, config={"a": 1}, manifest={}
    )


def metrics(step, **values):
    return {"step": step, "updates": step // 2, **values}


def episode(step, success, phase="train", selector="hcpg", **values):
    steps = {"success_once": success, "steps_to_success": 12 if success else -1, "return": 2.0 * success}
    return {"step": step, "phase": phase, "selector": selector, "length": 60, **steps, **values}


def test_episodes_are_averaged_by_step_phase_and_selector():
    rows = [episode(40, True), episode(40, False), episode(50, True, "evaluation")]
    rows.append(episode(50, False, "evaluation", "bare", **{"return": None}))
    found = values_by_step([metrics(50, loss=0.5)], rows)
    assert list(found) == [40, 50]
    assert found[40] == {
        "train_episodes/success_once": 0.5,
        "train_episodes/return": 1.0,
        "train_episodes/length": 60.0,
        "train_episodes/steps_to_success": 12.0,
    }
    assert found[50]["train/loss"] == 0.5
    assert found[50]["evaluation/hcpg/success_once"] == 1.0
    # Nobody succeeded, and a return that was not finite is left out.
    assert {name for name in found[50] if "bare" in name} == {
        "evaluation/bare/success_once",
        "evaluation/bare/length",
    }


def test_a_step_is_passed_on_once_it_is_complete(folder):
    follower = Follower(folder, ["listener"])
    folder.append("episodes", [episode(10, True)])
    folder.append("metrics", [metrics(20, loss=1.0)])
    follower.update()
    assert [step for step, _ in Listener.last.told] == [10]
    folder.append("episodes", [episode(20, True, "evaluation")])
    with (folder.path / "metrics.jsonl").open("a") as file:
        file.write('{"step": 40, "upd')  # a write that is still under way
    follower.update()
    assert [step for step, _ in Listener.last.told] == [10]
    folder.append("metrics", [metrics(40, loss=0.5)])
    follower.update()
    assert Listener.last.told[1] == (
        20,
        {
            "train/updates": 10.0,
            "train/loss": 1.0,
            "evaluation/hcpg/success_once": 1.0,
            "evaluation/hcpg/return": 2.0,
            "evaluation/hcpg/length": 60.0,
            "evaluation/hcpg/steps_to_success": 12.0,
        },
    )
    follower.close()
    assert [step for step, _ in Listener.last.told] == [10, 20, 40]
    assert Listener.last.closed
    assert Listener.last.run.name == "point/reach/hcpg_flow/s3"


def test_rows_taken_back_by_a_resume_are_told_anew(folder):
    folder.append("metrics", [metrics(step) for step in (10, 20, 30)])
    folder.append("episodes", [episode(20, True)])
    follower = Follower(folder, ["listener"])
    follower.update()
    first = Listener.last
    folder.rewind(10)
    folder.append("metrics", [metrics(20, again=1.0), metrics(40)])
    follower.update()
    assert first.closed
    assert [(step, "train/again" in values) for step, values in Listener.last.told] == [
        (10, False),
        (20, True),
    ]
    follower.close()


def test_a_run_is_over_when_its_status_says_so_or_nobody_trains_it(folder):
    follower = Follower(folder, ["listener"])
    assert (follower.ended(), follower.ended()) == (False, True)
    with (folder.path / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert [follower.ended() for _ in range(3)] == [False] * 3
        folder.set_status("finished", step=40)
        assert follower.ended()


def test_the_command_mirrors_a_trained_run(straight, capsys):
    path = straight[0].path
    assert cli.main(["track", str(path), "--tracker", "tensorboard", "--follow"]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    [events] = (path / "tensorboard").glob("events.*")
    content = events.read_bytes()
    evaluations = [row for row in straight[0].rows("episodes") if row["phase"] == "evaluation"]
    # Two selectors were evaluated at two steps.
    assert len({(row["step"], row["selector"]) for row in evaluations}) == 4
    for name in ("hcpg", "bare"):
        assert content.count(f"evaluation/{name}/success_once".encode()) == 2


def test_no_run_is_an_error(tmp_path, capsys):
    assert cli.main(["track", str(tmp_path), "--tracker", "wandb"]) == 2
    assert "no run under" in capsys.readouterr().err


class Quiet:
    """A view that shows nothing."""

    def __init__(self):
        self.heard = []

    def tell(self, lane, message):
        self.heard.append(message.kind)

    def say(self, text):
        self.heard.append(text)

    def beat(self):
        self.heard.append("beat")


def test_training_starts_one_tracker_for_all_its_runs_once_they_train(straight):
    folder = straight[0]
    lanes = [Lane("point/reach", "hcpg_flow", seed, 240) for seed in (0, 1)]
    view = Quiet()
    tracked = TrackedView(view, lanes, ["tensorboard"])
    events = folder.path / "tensorboard"
    for lane in lanes[:1] * 2:
        tracked.tell(lane, Message("opened", 0, {"folder": str(folder.path)}))
        tracked.tell(lane, Message("progress", 0, {}))
    assert tracked.finish() == ""  # the second run has not begun: nothing was started
    before = set(events.glob("*"))
    tracked.tell(lanes[1], Message("failed", 1, {"error": "x"}))
    assert tracked.finish() == ""
    assert set(events.glob("*")) != before
    tracked.say("word")
    assert view.heard == ["opened", "progress"] * 2 + ["failed", "word"]


def test_a_failing_tracker_is_reported_with_the_way_to_repeat_it(tmp_path):
    lane = Lane("point/reach", "hcpg_flow", 0, 240)
    tracked = TrackedView(Quiet(), [lane], ["tensorboard"])
    tracked.tell(lane, Message("opened", 0, {"folder": str(tmp_path)}))
    tracked.tell(lane, Message("progress", 0, {}))
    trouble = tracked.finish()
    assert trouble.startswith(f"the trackers failed, see {tmp_path / 'tracker.txt'}; run again: hcpg track")
    assert "no run under" in (tmp_path / "tracker.txt").read_text()


def test_the_settings_reach_the_tracker(folder):
    Follower(folder, ["listener"])
    assert Listener.last.run.config == json.loads((folder.path / "config.json").read_text())
