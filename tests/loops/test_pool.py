"""The pool over the built-in point suite: bookkeeping, no dependence on the workers, every fault by name."""

from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest

from hcpg import registry
from hcpg.loops.pool import Pool, WorkerError
from hcpg.loops.worker import NOBODY, Sizes, Station, board_bytes, board_in
from hcpg.types import Step

TASK, HORIZON = "point/carry", 60
SIZE, STEPS = 3, 200


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


def test_episodes_can_be_cut_before_the_tasks_own_limit():
    with Pool(TASK, [5, 6], workers=2, horizon=7) as pool:
        pool.reset(np.zeros(2, int))
        cut = []
        for _ in range(15):
            pool.send(np.zeros((2, 4), np.float32), np.ones(2, int))
            cut.append(pool.receive().truncated.all())
    assert [step for step, each in enumerate(cut) if each] == [6, 13]


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
