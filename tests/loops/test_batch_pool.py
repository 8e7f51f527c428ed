"""A batch in this process does what worker processes do: the same arrivals, and the same run bit for bit."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from tiny_runs import checkpoint_digests, sit

from hcpg import registry
from hcpg.interfaces import BatchedSuite
from hcpg.loops import batch_pool, sitting
from hcpg.loops.batch_pool import BatchPool, open_pool
from hcpg.loops.pool import Pool
from hcpg.suites.point import SUITE, PointSuite

TASK = "point/reach"


class PointBatch:
    """Point environments behind the socket of a batch; arrays are JAX's."""

    def __init__(self, seeds):
        self.environments = [SUITE.make(registry.task(TASK), seed) for seed in seeds]
        self.closed = 0

    def reset(self, starts):
        pairs = zip(self.environments, starts, strict=True)
        return jnp.asarray(np.stack([each.reset(int(start)) for each, start in pairs]))

    def step(self, actions):
        pairs = zip(self.environments, np.asarray(actions), strict=True)
        steps = [each.step(action) for each, action in pairs]
        columns = zip(
            *((step.observation, np.float32(step.reward), step.success) for step in steps), strict=True
        )
        return tuple(jnp.asarray(np.stack(column)) for column in columns)

    def close(self):
        self.closed += 1


@pytest.fixture
def accelerated(monkeypatch):
    """A machine whose JAX has a GPU, as far as pools know, and a suite that makes batches; those made."""
    made = []

    def make_batch(suite, task, seeds):
        made.append(PointBatch(seeds))
        return made[-1]

    monkeypatch.setattr(PointSuite, "make_batch", make_batch, raising=False)
    monkeypatch.setattr(batch_pool, "jax", SimpleNamespace(default_backend=lambda: "gpu"))
    return made


def test_a_batch_is_made_only_where_an_accelerator_is_and_a_suite_can(accelerated, monkeypatch):
    with open_pool(TASK, [3, 4], workers=1) as pool:
        assert type(pool) is BatchPool
        assert (pool.size, pool.spec, pool.exact) == (2, (11, 4), False)
    assert [batch.closed for batch in accelerated] == [1]
    monkeypatch.setattr(batch_pool, "jax", SimpleNamespace(default_backend=lambda: "cpu"))
    with open_pool(TASK, [3], workers=1) as pool:
        assert type(pool) is Pool
    made_by = {name: isinstance(registry.suite(name), BatchedSuite) for name in ("metaworld", "maniskill")}
    assert made_by == {"metaworld": False, "maniskill": True}
    assert len(accelerated) == 1


def test_arrivals_are_those_of_worker_processes_across_the_time_limit(accelerated):
    actions = np.random.default_rng(0).uniform(-1, 1, (8, 2, 4)).astype(np.float32)
    rows = []
    for make in (open_pool, Pool):
        with make(TASK, [3, 4], workers=1, horizon=5) as pool:
            seen = [np.asarray(pool.reset(np.array([7, 8])))]
            for tick, each in enumerate(actions):
                pool.send(each, np.array([20 + tick, 30 + tick]))
                arrival = pool.receive()
                seen += [np.asarray(field, np.float32).ravel() for field in arrival]
            rows.append(np.concatenate([each.ravel() for each in seen]))
            assert isinstance(arrival.observations, jax.Array) == (make is open_pool)
    assert np.array_equal(rows[0], rows[1])


def test_an_episode_is_taken_up_in_its_middle_and_ends_in_time(accelerated):
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 3, 4)).astype(np.float32)
    with open_pool(TASK, [3, 4], workers=1, horizon=4) as pool:
        back = pool.restore(np.array([7, 8]), list(actions))
        pool.reset(np.array([7, 8]))
        for action in actions.swapaxes(0, 1):
            pool.send(action, np.array([9, 9]))
            arrival = pool.receive()
        assert np.array_equal(back, arrival.observations)
        pool.restore(np.array([7, 8]), list(actions))
        pool.send(actions[:, 0], np.array([9, 9]))
        assert pool.receive().truncated.all()


def test_what_a_pool_refuses_a_batch_refuses(accelerated):
    with open_pool(TASK, [3, 4], workers=1) as pool:
        pool.reset(np.array([0, 1]))
        with pytest.raises(RuntimeError, match=r"receive\(\) without send\(\)"):
            pool.receive()
        with pytest.raises(ValueError, match=r"\(2, 3\); point/reach needs \(2, 4\)"):
            pool.send(np.zeros((2, 3), np.float32), np.array([0, 1]))
        with pytest.raises(RuntimeError, match="a batch draws nothing"):
            pool.render(0)


def test_a_run_on_batches_is_the_run_on_workers_bit_for_bit_also_after_a_resume(
    straight, accelerated, tmp_path
):
    whole, settings = straight
    [folder] = sitting.create_folders(settings, [1], tmp_path)
    asked = []
    sit(settings, [folder], stop=lambda: asked.append(None) or len(asked) > 17)
    assert folder.status()["step"] == 17 * 4
    sit(settings, [folder])
    assert checkpoint_digests(folder) == checkpoint_digests(whole)
    assert folder.rows("episodes") == whole.rows("episodes")
    assert [len(batch.environments) for batch in accelerated] == [4, 4, 4]  # training, again, evaluation
    assert all(batch.closed for batch in accelerated)
