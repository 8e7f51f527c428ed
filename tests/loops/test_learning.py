"""The learner's loop: how many updates, on which rows, with which keys; and that no selector reaches it."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from stand_ins import Follower, Scalar

from hcpg import presets, registry
from hcpg.loops import learning, replay
from hcpg.types import Batch, Sampling, Spec

SPEC = Spec(3, 4)


def memory_of(runs, rewards):
    """Eight rows per run; run r's rewards are `rewards[r]`."""
    generator = np.random.default_rng(0)
    memory = replay.create(runs, 8, SPEC)
    rows = Batch(
        generator.normal(size=(runs, 8, 3)).astype(np.float32),
        generator.uniform(-1, 1, (runs, 8, 4)).astype(np.float32),
        np.asarray(rewards, np.float32),
        generator.normal(size=(runs, 8, 3)).astype(np.float32),
        np.zeros((runs, 8), np.float32),
    )
    return jax.jit(replay.insert)(memory, rows)


def keys_of(runs):
    return jax.random.split(jax.random.key(0), runs), jax.random.split(jax.random.key(1), runs)


def fresh(runs):
    return Scalar(jnp.zeros(runs), jnp.int32(0))


@pytest.fixture(scope="module")
def learn():
    """Four updates of two runs on batches of three."""
    return learning.compiled(Follower(), Scalar, runs=2, updates=4, batch_size=3)


def test_it_makes_the_updates_asked_for_and_tells_their_mean(learn):
    memory = memory_of(2, [[1.0] * 8, [2.0] * 8])
    states, metrics, finite = learn(fresh(2), memory, *keys_of(2))
    assert int(states.updates) == 4
    assert states.level.tolist() == [4.0, 8.0]
    assert metrics["level"].tolist() == [(1 + 2 + 3 + 4) / 4, (2 + 4 + 6 + 8) / 4]
    assert metrics["delayed"].tolist() == [(2 + 4) / 2, (4 + 8) / 2]  # only every second update reports it
    assert finite.tolist() == [True, True]


def test_what_no_update_reports_is_nan():
    one = learning.compiled(Follower(), Scalar, runs=1, updates=1, batch_size=3)
    _, metrics, _ = one(fresh(1), memory_of(1, [[1.0] * 8]), *keys_of(1))
    assert np.isnan(metrics["delayed"]).all()


def test_two_calls_go_on_where_one_longer_call_would(learn):
    """Keys come from the count of updates: a resume needs no generator's state."""
    memory = memory_of(2, np.arange(16.0).reshape(2, 8))
    half = learning.compiled(Follower(), Scalar, runs=2, updates=2, batch_size=3)
    whole, _, _ = learn(fresh(2), memory, *keys_of(2))
    states, first, _ = half(fresh(2), memory, *keys_of(2))
    states, second, _ = half(states, memory, *keys_of(2))
    np.testing.assert_array_equal(states.level, whole.level)
    assert not (first["luck"] == second["luck"]).any()


def test_a_run_learns_among_others_as_alone(learn):
    rewards = np.arange(16.0).reshape(2, 8)
    both, _, _ = learn(fresh(2), memory_of(2, rewards), *keys_of(2))
    alone = learning.compiled(Follower(), Scalar, runs=1, updates=4, batch_size=3)
    keys = [each[1:] for each in keys_of(2)]
    own, metrics, _ = alone(fresh(1), memory_of(1, rewards[1:]), *keys)
    np.testing.assert_allclose(own.level[0], both.level[1], rtol=1e-6)
    assert metrics["level"].shape == (1,)


def test_batches_are_drawn_as_the_method_wants_them():
    class Forgetful(Follower):
        sampling = Sampling(recent_share=1.0, recent_window=2)

    rewards = [[5.0] * 6 + [1.0, 1.0], [5.0] * 6 + [2.0, 2.0]]
    of_the_newest = learning.compiled(Forgetful(), Scalar, runs=2, updates=4, batch_size=3)
    states, _, _ = of_the_newest(fresh(2), memory_of(2, rewards), *keys_of(2))
    assert states.level.tolist() == [4.0, 8.0]


def test_a_run_that_diverges_is_told_and_the_other_goes_on(learn):
    memory = memory_of(2, [[np.inf] * 8, [1.0] * 8])
    states, _, finite = learn(fresh(2), memory, *keys_of(2))
    assert finite.tolist() == [False, True]
    assert float(states.level[1]) == 4.0


def test_the_first_bad_number_is_named():
    sound = {"weights": [jnp.ones(2), jnp.ones(3)], "count": jnp.int32(1)}
    assert bool(learning.is_finite(sound))
    broken = {**sound, "weights": [jnp.ones(2), jnp.array([1.0, jnp.nan, 1.0])]}
    assert not bool(learning.is_finite(broken))
    assert learning.first_bad_leaf(broken) == "state['weights'][1]"


def learned_under(preset):
    settings = presets.settings("point/carry", preset, "cpu")
    learner = replace(settings.learner, actor_hidden_size=8, critic_hidden_size=8, policy_delay=2)
    method = registry.method(settings.method).METHOD(learner, SPEC)
    states = jax.tree.map(lambda leaf: leaf[None], jax.jit(method.init)(jax.random.key(4)))
    states = states._replace(updates=states.updates[0])
    compiled = learning.compiled(method, type(states), runs=1, updates=4, batch_size=4)
    return compiled(states, memory_of(1, [np.arange(8.0)]), *keys_of(1))


def test_hcpg_flow_and_sac_flow_learn_the_same_from_the_same_data():
    (one, metrics, _), (other, _, _) = learned_under("hcpg_flow"), learned_under("sac_flow")
    jax.tree.map(np.testing.assert_array_equal, one, other)
    assert int(one.updates) == 4
    assert float(metrics["actor_gradient"][0]) > 0.0
