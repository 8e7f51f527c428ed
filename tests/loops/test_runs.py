"""A run folder is complete or absent, survives a kill, and refuses what does not belong to it."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from hcpg.loops.runs import RunFolder, RunFolderError
from hcpg.report.rows import RowError

CONFIG = {"budget": {"steps": 100}, "network": {"width": 256, "sizes": (4, 5)}, "task": "point/reach"}


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(
        tmp_path,
        task="point/reach",
        preset="hcpg_flow",
        seed=3,
        config=CONFIG,
        manifest={"update_ratio": 0.25},
    )


def test_create_lays_out_one_folder_per_run(run, tmp_path):
    assert run.path.parent == tmp_path / "point" / "reach" / "hcpg_flow" / "s3"
    assert sorted(part.name for part in run.path.iterdir()) == [
        "checkpoints",
        "config.json",
        "manifest.json",
        "status.json",
        "videos",
    ]
    assert run.config()["network"] == {"width": 256, "sizes": [4, 5]}
    assert run.manifest()["update_ratio"] == 0.25
    assert run.manifest()["run"] == {
        "id": run.path.name,
        "task": "point/reach",
        "preset": "hcpg_flow",
        "seed": 3,
    }
    assert [path.name for path in run.path.parent.iterdir()] == [run.path.name]


def test_two_runs_of_one_second_get_two_folders(tmp_path):
    address = {"task": "point/reach", "preset": "p", "seed": 0, "config": {}, "manifest": {}}
    assert len({RunFolder.create(tmp_path, **address).path for _ in range(20)}) == 20


def test_open_finds_the_folder_from_inside(run):
    inside = run.checkpoints / "step_000000010"
    inside.mkdir()
    assert RunFolder.open(inside) == run
    assert RunFolder.open(run.checkpoints) == run
    assert RunFolder.open(run.path) == run


def test_open_names_what_is_missing(run, tmp_path):
    with pytest.raises(RunFolderError, match=f"holds 1 of them; name one, e.g. the newest, {run.path}"):
        RunFolder.open(tmp_path)
    with pytest.raises(RunFolderError, match="there is nothing at"):
        RunFolder.open(tmp_path / "gone")
    (run.path / "config.json").unlink()
    with pytest.raises(RunFolderError, match=r"lacks config\.json\. Restore what was deleted, or start"):
        RunFolder.open(run.path)


def test_rows_come_back_as_plain_numbers(run):
    run.append(
        "metrics", [{"step": np.int64(5), "loss": np.float32(0.5), "rate": float("nan")}, {"step": 10}]
    )
    run.append("metrics", [{"step": 15}])
    assert run.rows("metrics") == [{"step": 5, "loss": 0.5, "rate": None}, {"step": 10}, {"step": 15}]
    assert run.rows("episodes") == []
    assert "NaN" not in (run.path / "metrics.jsonl").read_text()


def test_a_row_that_no_reader_could_place_is_refused(run):
    with pytest.raises(RowError, match=r"whole number under 'step', got 1\.5"):
        run.append("metrics", [{"step": 1.5}])
    with pytest.raises(RowError, match="'weights' holds"):
        run.append("metrics", [{"step": 1, "weights": np.zeros(2)}])
    assert run.rows("metrics") == []


def test_a_torn_last_line_is_dropped_and_does_not_spoil_the_next(run, caplog):
    run.append("episodes", [{"step": 1}, {"step": 2}])
    with (run.path / "episodes.jsonl").open("a") as file:
        file.write('{"step": 3, "succ')
    assert run.rows("episodes") == [{"step": 1}, {"step": 2}]
    assert "dropped a torn last line (17 bytes)" in caplog.text
    run.append("episodes", [{"step": 4}])
    assert run.rows("episodes") == [{"step": 1}, {"step": 2}, {"step": 4}]


def test_a_corrupt_middle_line_is_an_error_with_its_number(run):
    (run.path / "metrics.jsonl").write_text('{"step": 1}\n{"st\n{"step": 3}\n')
    with pytest.raises(RowError, match=r"metrics\.jsonl, line 2 is not JSON"):
        run.rows("metrics")
    (run.path / "metrics.jsonl").write_text('{"step": 1}\n[]\n')
    with pytest.raises(RowError, match="line 2 is no row with a 'step'"):
        run.rows("metrics")


def test_rewind_drops_what_ran_ahead_of_the_checkpoint(run):
    run.append("metrics", [{"step": step} for step in (10, 20, 30)])
    run.append("episodes", [{"step": step} for step in (20, 20, 21)])
    run.rewind(20)
    assert [row["step"] for row in run.rows("metrics")] == [10, 20]
    assert [row["step"] for row in run.rows("episodes")] == [20, 20]
    assert not list(run.path.glob(".*"))


def test_status_keeps_the_last_state_and_its_facts(run):
    assert run.status()["state"] == "running"
    run.set_status("diverged", step=70, quantity="critic_loss")
    assert {**run.status(), "time": ""} == {
        "state": "diverged",
        "time": "",
        "step": 70,
        "quantity": "critic_loss",
    }


def test_check_config_names_each_difference(run):
    run.check_config({**CONFIG, "budget": {"steps": 200}})
    other = {"budget": {"steps": 200}, "network": {"width": 512, "sizes": (4, 5)}, "gamma": 0.9}
    with pytest.raises(RunFolderError) as caught:
        run.check_config(other)
    lines = str(caught.value).splitlines()
    assert lines[1:-1] == [
        "  gamma: absent in the run, 0.9 asked for",
        "  network.width: 256 in the run, 512 asked for",
        '  task: "point/reach" in the run, absent asked for',
    ]
    run.check_config({**CONFIG, "network": {"width": 1}}, may_differ=["network"])
    with pytest.raises(RunFolderError, match=r"budget\.steps: 100 in the run, 200 asked for"):
        run.check_config({**CONFIG, "budget": {"steps": 200}}, may_differ=[])


def test_set_config_is_what_the_next_resume_is_checked_against(run):
    run.set_config({**CONFIG, "budget": {"steps": 200}})
    assert run.config()["budget"] == {"steps": 200}


def test_a_folder_in_use_is_refused_and_a_killed_user_is_no_problem(run):
    script = (
        "import sys, time; from pathlib import Path; from hcpg.loops.runs import RunFolder\n"
        "with RunFolder.open(Path(sys.argv[1])).lock(): print('held', flush=True); time.sleep(60)"
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", script, str(run.path)], stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    with pytest.raises(RunFolderError, match=f"process {holder.pid} is training in"), run.lock():
        pass
    holder.send_signal(signal.SIGKILL)
    holder.communicate()
    with run.lock():
        assert (run.path / "lock").read_text() == f"{os.getpid()}\n"
        with pytest.raises(RunFolderError, match=f"process {os.getpid()} is training"), run.lock():
            pass
    with run.lock():
        pass


def test_a_write_that_fails_leaves_the_old_file(run):
    with pytest.raises(ValueError, match="not JSON compliant"):
        run.set_status("finished", success=float("nan"))
    assert json.loads((run.path / "status.json").read_text())["state"] == "running"
