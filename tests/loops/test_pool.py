"""The pool over the built-in point suite: bookkeeping, no dependence on the workers, every fault by name."""

import os
import signal
import subprocess
import sys
import threading
import time
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np
import pytest

from hcpg import registry
from hcpg.loops.pool import Pool, WorkerError
from hcpg.loops.worker import NOBODY, Sizes, Station, board_bytes, board_in
from hcpg.types import Step

TASK, HORIZON = "point/carry", 60
SIZE, STEPS = 3, 200
SOURCE = Path(__file__).parents[2] / "src"


def play(workers):
    """The first observations and STEPS arrivals of three environments under fixed random actions."""
    actions = np.random.default_rng(0).uniform(-1, 1, (STEPS, SIZE, 4)).astype(np.float32)
    with Pool(TASK, [5, 6, 7], workers=workers) as pool:
        first = pool.reset(np.arange(SIZE))
        arrivals = []
        for step, action in enumerate(actions):
            pool.send(action, np.arange(SIZE) + 10 * (step + 1))
            arrivals.append(pool.receive())
    return first, actions, arrivals


@pytest.fixture(scope="module")
def played():
    return play(workers=1)


@pytest.mark.parametrize("workers", [2, 3])
def test_the_number_of_workers_changes_no_bit(played, workers):
    first, _, arrivals = play(workers)
    assert first.tobytes() == played[0].tobytes()
    for ours, theirs in zip(arrivals, played[2], strict=True):
        assert [part.tobytes() for part in ours] == [part.tobytes() for part in theirs]


def test_episodes_have_exactly_the_horizon_and_the_next_start_follows(played):
    _, _, arrivals = played
    ends = [step for step, arrival in enumerate(arrivals) if arrival.truncated.any()]
    assert ends == [59, 119, 179]
    assert all(arrivals[step].truncated.all() for step in ends)
    assert not any(arrival.terminated.any() for arrival in arrivals)
    suite, task = registry.suite("point"), registry.task(TASK)
    for index, seed in enumerate((5, 6, 7)):
        again = suite.make(task, seed).reset(index + 10 * 60)
        assert arrivals[59].observations[index].tolist() == again.tolist()


def test_the_true_last_observation_comes_back_beside_the_reset_one(played):
    first, actions, arrivals = played
    environment = registry.suite("point").make(registry.task(TASK), 6)
    assert environment.reset(1).tolist() == first[1].tolist()
    for action, arrival in zip(actions[:HORIZON], arrivals, strict=False):
        answer = environment.step(action[1])
        assert arrival.next_observations[1].tolist() == answer.observation.tolist()
        assert arrival.rewards[1] == np.float32(answer.reward)
        if not arrival.truncated[1]:
            assert arrival.observations[1].tolist() == answer.observation.tolist()
    assert arrivals[59].observations[1].tolist() != answer.observation.tolist()


def test_restore_continues_the_undisturbed_trajectory_bit_for_bit(played):
    first, actions, arrivals = played
    # Environment 0 had made 20 steps, environment 1 none, environment 2 was one step before its end.
    lengths = [20, 0, 59]
    with Pool(TASK, [5, 6, 7], workers=2) as pool:
        back = pool.restore(np.arange(SIZE), [actions[:length, e] for e, length in enumerate(lengths)])
        assert back[0].tobytes() == arrivals[19].observations[0].tobytes()
        assert back[1].tobytes() == first[1].tobytes()
        assert back[2].tobytes() == arrivals[58].observations[2].tobytes()
        pool.send(np.stack([actions[length, e] for e, length in enumerate(lengths)]), np.arange(SIZE) + 600)
        arrival = pool.receive()
    assert arrival.next_observations[0].tobytes() == arrivals[20].next_observations[0].tobytes()
    assert arrival.next_observations[1].tobytes() == arrivals[0].next_observations[1].tobytes()
    assert arrival.truncated.tolist() == [False, False, True]
    assert arrival.observations[2].tobytes() == arrivals[59].observations[2].tobytes()


def test_restore_refuses_a_whole_episode():
    with Pool(TASK, [0], workers=1) as pool, pytest.raises(WorkerError, match="cannot continue after 60"):
        pool.restore(np.array([0]), [np.zeros((60, 4), np.float32)])


def test_arrivals_are_the_callers_to_keep():
    with Pool(TASK, [0], workers=1) as pool:
        kept = pool.reset(np.array([0]))
        before = kept.copy()
        pool.send(np.ones((1, 4), np.float32), np.array([1]))
        arrival = pool.receive()
        tool = arrival.observations[0, 0:3].copy()
        pool.send(-np.ones((1, 4), np.float32), np.array([1]))
        pool.receive()
    assert kept.tolist() == before.tolist()
    assert arrival.observations[0, 0:3].tolist() == tool.tolist()
    np.testing.assert_allclose(tool - before[0, 0:3], 0.02, atol=1e-7)


def test_more_workers_than_environments_and_a_picture():
    with Pool(TASK, [3, 4], workers=5) as pool:
        assert (pool.size, pool.spec) == (2, (11, 4))
        pool.reset(np.array([0, 9]))
        alone = registry.suite("point").make(registry.task(TASK), 4)
        alone.reset(9)
        assert pool.render(1).tolist() == alone.render().tolist()
        pool.close()


def test_misuse_is_told_at_once():
    with pytest.raises(ValueError, match="at least one seed and one worker, got 0 and 1"):
        Pool(TASK, [], workers=1)
    with Pool(TASK, [0], workers=1) as pool:
        pool.reset(np.array([0]))
        with pytest.raises(ValueError, match=r"shape \(1, 3\); point/carry needs \(1, 4\)"):
            pool.send(np.zeros((1, 3), np.float32), np.array([1]))
        with pytest.raises(RuntimeError, match="without send"):
            pool.receive()
        pool.send(np.zeros((1, 4), np.float32), np.array([1]))
        with pytest.raises(RuntimeError, match="step before the answer"):
            pool.send(np.zeros((1, 4), np.float32), np.array([1]))


class Countdown:
    """Ends itself after three steps and observes `100 * start + step`."""

    def reset(self, start):
        self.start, self.age = start, 0
        return np.array([100.0 * start])

    def step(self, action):
        self.age += 1
        return Step(np.array([100.0 * self.start + self.age]), float(action[0]), self.age == 3, self.age == 2)

    def render(self):
        return np.full((2, 2, 3), self.age, np.uint8)

    def close(self):
        self.start = None


@pytest.mark.parametrize(
    ("horizon", "terminated", "truncated"), [(5, True, False), (3, True, False), (2, False, True)]
)
def test_a_termination_goes_before_the_time_limit(horizon, terminated, truncated):
    sizes = Sizes(environments=1, observation=1, action=1, workers=1)
    memory = SharedMemory(create=True, size=board_bytes(sizes))
    board = board_in(memory, sizes)
    station = Station({0: Countdown()}, horizon, board)
    board.starts[0], board.actions[0, 0] = 7, 0.5
    station.reset()
    board.starts[0] = 8
    length = 3 if terminated else 2
    for age in range(1, length + 1):
        station.step()
        assert board.next_observations[0, 0] == 700 + age
        assert board.success[0] == (age == 2)
        assert board.rewards[0] == 0.5
    assert (board.terminated[0], board.truncated[0]) == (terminated, truncated)
    assert board.observations[0, 0] == 800
    assert station.render(0).tolist() == np.zeros((2, 2, 3)).tolist()
    assert board.busy[0] == NOBODY
    del board, station
    memory.close()
    memory.unlink()


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
