"""Real trainings on this machine, seconds long: made once, stopped and taken up again, shared by launches."""

import os
import signal
import threading

import pytest
from tiny_cells import await_rows, cell, on_cores

from hcpg.experiments import engine, local, slots
from hcpg.experiments.claims import is_locked, locked
from hcpg.experiments.engine import run
from hcpg.experiments.ledger import entries
from hcpg.experiments.units import units
from hcpg.loops.runs import RunFolder

CORE = sorted(os.sched_getaffinity(0))[0]


@pytest.fixture(autouse=True)
def alone(tmp_path_factory, monkeypatch):
    """Cores of this test's own to share, whoever else trains on this machine."""
    folder = tmp_path_factory.mktemp("own")
    monkeypatch.setattr(slots, "own_folder", lambda: folder)
    monkeypatch.setattr(engine, "POLL_S", 0.1)
    monkeypatch.setenv("PYTHONWARNINGS", "ignore")


def test_a_stopped_launch_saves_and_the_next_one_finishes_in_the_same_folder(tmp_path):
    cells, told = [cell(0, steps=4000, evaluations=1)], []

    def stop_when_training(text):
        if "started" in text:
            told.append(text)
            threading.Thread(target=interrupt, daemon=True).start()

    def interrupt():
        await_rows(tmp_path)
        os.kill(os.getpid(), signal.SIGTERM)

    assert run(cells, tmp_path, on_cores([CORE]), stop_when_training) == ([], signal.SIGTERM)
    assert told == [f"point/reach sac s0: started on core {CORE}"]
    [stopped] = entries(cells, tmp_path)
    assert stopped.state == "stopped"
    assert 0 < RunFolder(stopped.folder).status()["step"] < 4000
    assert run(cells, tmp_path, on_cores([CORE]), told.append) == ([], None)
    [finished] = entries(cells, tmp_path)
    assert (finished.state, finished.folder) == ("finished", stopped.folder)
    assert finished.step == 4000
    steps = [row["step"] for row in RunFolder(finished.folder).rows("metrics")]
    assert steps == sorted(set(steps))


def test_a_run_that_fails_leaves_its_words_in_the_log(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "command", lambda unit, results: ["train", "--task", "point/none"])
    told = []
    assert run([cell(0)], tmp_path, on_cores([CORE]), told.append).failed == [cell(0)]
    log = tmp_path / "logs/point-reach_sac_s0.txt"
    assert "failed with exit code 2" in told[2]
    assert told[2].endswith(f"see {log}")
    assert "no task is named 'point/none'" in log.read_text()


def test_two_launches_never_share_a_core_and_a_job_keeps_its_locks_beyond_its_launch(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "command", lambda unit, results: ["train", "--help"])
    first, second = on_cores([CORE]), on_cores([CORE])
    [unit] = units([entries([cell(0)], tmp_path)[0]], together=False)
    assert first.room()
    assert first.room()  # the same place: it is kept until a job comes
    assert not second.room()
    claim = locked(tmp_path / "claim")
    job = first.start(unit, tmp_path, [claim])
    job.process.send_signal(signal.SIGSTOP)
    claim.close()  # as if the launch had died: the job has both locks yet
    job.lock.close()
    assert (is_locked(tmp_path / "claim"), second.room()) == (True, False)
    assert os.sched_getaffinity(job.process.pid) == {CORE}
    job.process.send_signal(signal.SIGCONT)
    assert job.process.wait() == 0
    assert (is_locked(tmp_path / "claim"), second.room()) == (False, True)
    second.close()
    assert first.room()
    first.close()
