"""The launcher: it makes what is missing, once; it can be stopped and launched twice at once."""

import os
import signal
import threading
import time

import pytest
from tiny_cells import cell

from hcpg.commands.options import overridden
from hcpg.experiments import engine
from hcpg.experiments.engine import command, run
from hcpg.experiments.ledger import Entry, entries
from hcpg.loops.runs import RunFolder
from hcpg.presets import settings

CORES = sorted(os.sched_getaffinity(0))


@pytest.fixture(autouse=True)
def quiet(monkeypatch):
    monkeypatch.setenv("PYTHONWARNINGS", "ignore")
    monkeypatch.setattr(engine, "POLL_S", 0.1)


def test_the_command_of_a_cell_leads_to_its_settings(tmp_path):
    each = cell(3, steps=100)
    words = command(Entry(each, "left"), tmp_path)
    assert words[:7] == ["train", "--task", "point/reach", "--preset", "sac", "--budget", "cpu"]
    assert words[7:11] == ["--seeds", "3", "--out", str(tmp_path)]
    assert overridden(settings("point/reach", "sac"), words[11:]) == each.settings
    folder = tmp_path / "x"
    assert command(Entry(each, "stopped", folder), tmp_path) == ["train", "--resume", str(folder)]


def test_missing_runs_are_made_and_a_second_launch_makes_none(tmp_path):
    told, cells = [], [cell(0), cell(1)]
    assert run(cells, tmp_path, CORES[:1], told.append) == ([], None)
    made = entries(cells, tmp_path)
    assert [entry.state for entry in made] == ["finished", "finished"]
    assert told[0] == "0 of 2 runs are done, 2 are left"
    assert told[1] == f"point/reach sac s0: started on core {CORES[0]}"
    assert told[2].startswith("point/reach sac s0: finished after ")
    again = []
    assert run(cells, tmp_path, CORES, again.append) == ([], None)
    assert again == ["2 of 2 runs are done, 0 are left"]
    assert entries(cells, tmp_path) == made


def test_a_stopped_launch_saves_and_the_next_one_goes_on_in_the_same_folder(tmp_path):
    cells = [cell(0, steps=40_000, evaluations=1)]

    def stop_when_training(text):
        if "started" in text:
            threading.Thread(target=interrupt, daemon=True).start()

    def interrupt():
        while not any(RunFolder(path).rows("metrics") for path in tmp_path.glob("point/reach/sac/s0/2*")):
            time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGTERM)

    ended = run(cells, tmp_path, CORES[:1], stop_when_training)
    assert ended == ([], signal.SIGTERM)
    stopped = entries(cells, tmp_path)[0]
    assert stopped.state == "stopped"
    assert 0 < RunFolder(stopped.folder).status()["step"] < 40_000
    assert command(stopped, tmp_path) == ["train", "--resume", str(stopped.folder)]


def test_a_cell_that_another_launch_has_claimed_is_left_to_it(tmp_path):
    (tmp_path / ".claims").mkdir()
    claim = engine._claimed(cell(0), tmp_path)
    told = []
    assert run([cell(0)], tmp_path, CORES[:1], told.append) == ([], None)
    assert told == ["0 of 1 runs are done, 1 are left"]
    assert entries([cell(0)], tmp_path)[0].state == "left"
    claim.close()


def test_a_run_that_fails_is_named_with_its_log_and_the_others_go_on(tmp_path, monkeypatch):
    asked = engine.command

    def broken(entry, results):
        return ["train", "--task", "point/none"] if entry.cell.seed == 0 else asked(entry, results)

    monkeypatch.setattr(engine, "command", broken)
    told, cells = [], [cell(0), cell(1)]
    ended = run(cells, tmp_path, CORES[:1], told.append)
    assert ended.failed == [cells[0]]
    assert "failed with exit code 2" in told[2]
    log = tmp_path / "logs/point-reach_sac_s0.txt"
    assert str(log) in told[2]
    assert "no task is named 'point/none'" in log.read_text()
    assert entries(cells, tmp_path)[1].state == "finished"
