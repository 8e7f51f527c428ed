"""A job on a node, without Ray: what it sends, in what state it leaves its node."""

import os
import shutil
import tempfile
import threading
import time
from pathlib import Path

import pytest
from tiny_cells import cell

import hcpg
from hcpg.experiments import slots, station
from hcpg.experiments.claims import is_locked, locked
from hcpg.experiments.ledger import entries
from hcpg.experiments.parcels import Parcel, land
from hcpg.experiments.slots import core_slots
from hcpg.experiments.station import Needs, Order, Station, StationError, checkpoints, sweep
from hcpg.experiments.units import command, units

CORE = sorted(os.sched_getaffinity(0))[0]


@pytest.fixture(autouse=True)
def node(tmp_path, monkeypatch):
    """A folder for what jobs leave on this node."""
    monkeypatch.setattr(slots, "own_folder", lambda: tmp_path / "own")
    monkeypatch.setattr(station, "own_folder", lambda: tmp_path / "own")
    monkeypatch.setenv("PYTHONWARNINGS", "ignore")
    return tmp_path / "own"


def order(unit, **changes):
    words = command(unit, Path())
    return Order(hcpg.__version__, words, unit.log, Parcel({}, {}), Needs(1, 0.0))._replace(**changes)


def test_a_job_sends_its_run_and_leaves_nothing_behind(tmp_path, node):
    results = tmp_path / "results"
    [unit] = units(entries([cell(0)], results), together=False)
    job = Station(send_s=0.0)
    news = job.start(order(unit))
    assert core_slots([CORE])[0].take() is None
    seen = []
    while news.code is None:
        land(news.parcel, results)
        seen += [entries([cell(0)], results)[0].state]
        time.sleep(0.05)
        news = job.news()
    land(news.parcel, results)
    assert news.code == 0
    [entry] = entries([cell(0)], results)
    assert (entry.state, entry.step) == ("finished", 64)
    assert entry.folder.relative_to(results).parts[:4] == ("point", "reach", "sac", "s0")
    assert "point/reach" in (results / unit.log).read_text()
    assert [path.name for path in sorted((entry.folder / "checkpoints").iterdir())] == [
        "step_000000032",
        "step_000000064",
    ]
    assert seen[0] == "left"
    job.close()
    assert list((node / "jobs").iterdir()) == []
    core_slots([CORE])[0].take().close()


def test_a_node_with_another_version_is_refused(tmp_path):
    [unit] = units(entries([cell(0)], tmp_path), together=False)
    with pytest.raises(StationError, match=r"has hcpg .*, the launcher 0\.0\.9\. Install one version"):
        Station().start(order(unit, version="0.0.9"))


def test_cores_are_the_jobs_own_and_the_schedulers_if_too_few_are_free():
    many = len(os.sched_getaffinity(0))
    first, second = Station(), Station()
    assert first._slot(Needs(many, 0.0)).cores == os.sched_getaffinity(0)
    assert second._slot(Needs(1, 0.0)).cores == frozenset()
    assert second._slot(Needs(1, 0.0)).variables == {"JAX_PLATFORMS": "cpu"}
    assert second._slot(Needs(1, 0.5)).variables == {"XLA_PYTHON_CLIENT_MEM_FRACTION": "0.38"}
    for lock in first._locks:
        lock.close()


def test_what_killed_jobs_left_is_swept_once_nobody_holds_it(tmp_path):
    folders = {name: Path(tempfile.mkdtemp(dir=tmp_path)) for name in ("old", "held", "new")}
    held = locked(folders["held"] / "lock")
    for name in ("old", "held"):
        os.utime(folders[name], (0, time.time() - station.LEFT_BEHIND_S - 1))
    sweep(tmp_path)
    assert set(tmp_path.iterdir()) - {tmp_path / "own"} == {folders["held"], folders["new"]}
    assert is_locked(folders["held"] / "lock")
    held.close()


def test_checkpoints_are_found_while_their_trainer_makes_and_deletes_folders(tmp_path):
    # Walking into every folder failed in 60 of 2,096 looks beside such a trainer, and the job with it.
    run = tmp_path / "point" / "reach" / "sac" / "s0" / "one"
    (run / "checkpoints" / "step_000000032").mkdir(parents=True)
    (run / "manifest.json").write_text("{}")
    ended = threading.Event()

    def write_and_delete():
        while not ended.is_set():
            (run / "checkpoints" / ".writing-step_000000064").mkdir()
            shutil.rmtree(run / "checkpoints" / ".writing-step_000000064")

    trainer = threading.Thread(target=write_and_delete)
    trainer.start()
    try:
        for _ in range(1000):
            assert checkpoints(tmp_path) == {run / "checkpoints" / "step_000000032"}
    finally:
        ended.set()
        trainer.join()
