"""Faults of the pool: killed, hung and failing workers by name, and nothing left behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from hcpg.loops.pool import Pool, WorkerError

TASK, HORIZON = "point/carry", 60
SOURCE = Path(__file__).parents[2] / "src"


def workers_of(process_id):
    """The worker processes that a process has started (the tracker of shared memory is not one)."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and (entry / "stat").exists():
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == process_id and b"spawn_main" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return sorted(found)


def alive(process_id):
    stat = Path(f"/proc/{process_id}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def gone_within(seconds, process_ids):
    deadline = time.monotonic() + seconds
    while any(map(alive, process_ids)) and time.monotonic() < deadline:
        time.sleep(0.02)
    return not any(map(alive, process_ids))


def exchange(pool, actions, next_starts):
    pool.send(actions, next_starts)
    return pool.receive()


@pytest.mark.parametrize("dies_before_send", [True, False])
def test_a_killed_worker_is_reported_with_all_that_matters(dies_before_send):
    with Pool(TASK, [11, 12], workers=2) as pool:
        pool.reset(np.array([3, 4]))
        second = workers_of(os.getpid())[1]
        actions = np.array([[0.0, 0.0, 0.0, 0.0], [0.25, 0.5, -1.0, 1.0]], np.float32)
        if dies_before_send:
            os.kill(second, signal.SIGKILL)
            assert gone_within(20, [second])
        else:
            os.kill(second, signal.SIGSTOP)
            threading.Timer(0.2, os.kill, [second, signal.SIGKILL]).start()
        with pytest.raises(WorkerError) as caught:
            exchange(pool, actions, np.array([5, 6]))
    message = str(caught.value)
    assert "point/carry: worker 1 with environment 1 (seed 12, start state 4, " in message
    assert "last action [0.25, 0.5, -1.0, 1.0])" in message
    assert "died with signal 9 (Killed)" in message


def test_a_hung_worker_is_reported_and_ended():
    with Pool(TASK, [11, 12], workers=2) as pool:
        pool.reset(np.array([3, 4]))
        first = workers_of(os.getpid())[0]
        os.kill(first, signal.SIGSTOP)
        pool.timeout_s = 0.3
        pool.send(np.zeros((2, 4), np.float32), np.array([5, 6]))
        started = time.monotonic()
        with pytest.raises(
            WorkerError, match=r"environment 0 \(seed 11, start state 3.*no answer within 0.3 s"
        ):
            pool.receive()
        assert 0.3 <= time.monotonic() - started < 10.0
        assert gone_within(20, [first])


def test_an_error_of_the_simulator_arrives_with_its_traceback():
    with Pool(TASK, [11, 12, 13], workers=1) as pool:
        pool.reset(np.array([3, 4, 5]))
        actions = np.zeros((3, 4), np.float32)
        actions[1, 2] = np.nan
        pool.send(actions, np.array([6, 7, 8]))
        with pytest.raises(WorkerError) as caught:
            pool.receive()
    message = str(caught.value)
    assert "environment 1 (seed 12, start state 4, last action [0.0, 0.0, nan, 0.0])" in message
    assert "environment 0" not in message
    assert "in step\n" in message
    assert "ValueError: an action of point is four finite numbers" in message


def test_the_start_state_in_the_report_follows_the_episodes():
    with Pool(TASK, [11], workers=1) as pool:
        pool.reset(np.array([3]))
        for _ in range(HORIZON):
            pool.send(np.zeros((1, 4), np.float32), np.array([44]))
            pool.receive()
        pool.send(np.full((1, 4), np.nan, np.float32), np.array([45]))
        with pytest.raises(WorkerError, match="start state 44"):
            pool.receive()


def shared_memory_of_this_process():
    maps = Path("/proc/self/maps").read_text().splitlines()
    return [line.partition("/dev/shm/")[2] for line in maps if "/dev/shm/psm_" in line]


def test_close_twice_leaves_no_worker_and_no_shared_memory():
    before = shared_memory_of_this_process()
    pool = Pool(TASK, [0, 1], workers=2)
    workers = workers_of(os.getpid())
    assert len(workers) == 2
    # One mapping more, and its name is gone already: nothing can be left behind in the file system.
    [mapping] = set(shared_memory_of_this_process()) - set(before)
    assert mapping.endswith(" (deleted)")
    pool.close()
    pool.close()
    assert not any(map(alive, workers))
    assert shared_memory_of_this_process() == before


SCRIPT = """
import os, signal, sys, time
import numpy as np
from hcpg.loops.pool import Pool
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background starts with it ignored
    pool = Pool("point/carry", [0, 1], workers=2)
    pool.reset(np.array([0, 1]))
    print("ready", flush=True)
    if sys.argv[1] == "wait":
        time.sleep(60)
"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    return path


def start(script, argument):
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    return subprocess.Popen(
        [sys.executable, str(script), argument], env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def test_workers_end_when_the_parent_is_killed(script):
    with start(script, "wait") as parent:
        assert parent.stdout.readline() == "ready\n"
        workers = workers_of(parent.pid)
        assert len(workers) == 2
        parent.kill()
        assert gone_within(20, workers)


def test_ctrl_c_and_sigterm_are_the_parents_alone(script):
    with start(script, "wait") as parent:
        assert parent.stdout.readline() == "ready\n"
        workers = workers_of(parent.pid)
        for worker in workers:
            os.kill(worker, signal.SIGINT)
            os.kill(worker, signal.SIGTERM)
        time.sleep(0.2)
        assert all(map(alive, workers))
        os.killpg(parent.pid, signal.SIGINT)
        assert "KeyboardInterrupt" in parent.communicate(timeout=60)[1]
        assert gone_within(20, workers)


def test_a_forgotten_pool_ends_with_its_program_in_silence(script):
    with start(script, "end") as parent:
        assert parent.communicate(timeout=60) == ("ready\n", "")
        assert parent.returncode == 0


def test_workers_load_no_jax_and_run_one_thread():
    with Pool(TASK, [0], workers=1):
        worker = workers_of(os.getpid())[0]
        environment = Path(f"/proc/{worker}/environ").read_bytes().split(b"\0")
        mapped = Path(f"/proc/{worker}/maps").read_text()
    assert b"OPENBLAS_NUM_THREADS=1" in environment
    assert b"OMP_NUM_THREADS=1" in environment
    assert "/numpy/" in mapped
    assert "/jaxlib/" not in mapped
