"""QSM's update against an independent one in PyTorch; its schedule, defaults and divergence."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import jax
import numpy as np
import pytest
import torch_qsm
from jax import numpy as jnp
from one_update import gradient_of, move, transitions

from hcpg.loops.learning import first_bad_leaf, is_finite
from hcpg.methods.qsm import QSM, Config, State
from hcpg.types import Batch, Spec

ROWS, OBSERVATIONS, ACTIONS = 8, 5, 3
TINY = Config(actor_hidden_size=8, critic_hidden_size=8)


class Case(NamedTuple):
    """One update of a moved state, and the numbers it drew."""

    before: State
    after: State
    metrics: dict
    batch: Batch
    of_critic: jax.Array
    times: jax.Array
    of_actor: jax.Array


METHOD = QSM(TINY, Spec(OBSERVATIONS, ACTIONS))
BATCH = transitions(ROWS, OBSERVATIONS, ACTIONS)


@cache
def moved_state():
    """A state whose every parameter is off its start, so that none can be left out unnoticed."""

    state = jax.jit(METHOD.init)(jax.random.key(0))
    critic = state.critic._replace(
        networks=move(state.critic.networks, 1), target=move(state.critic.target, 2)
    )
    return state._replace(actor=move(state.actor, 3), critic=critic)


update = jax.jit(METHOD.update)


@pytest.fixture(scope="module")
def case():
    key = jax.random.key(9)
    after, metrics = update(moved_state(), BATCH, key)
    of_critic, of_actor = jax.random.split(key)
    of_times, of_noise = jax.random.split(of_actor)
    return Case(
        moved_state(),
        after,
        metrics,
        BATCH,
        jax.random.normal(of_critic, (6, ROWS, ACTIONS)),
        jax.random.randint(of_times, (ROWS,), 0, 5),
        jax.random.normal(of_noise, (ROWS, ACTIONS)),
    )


def assert_learned_alike(parameters, optimizer_state, reference, published_share=1.0):
    """Gradients, and the parameters wherever the gradient is not so small that Adam's step is its noise."""
    compared = 0
    for own, found, expected, slope in zip(
        jax.tree.leaves(parameters),
        gradient_of(optimizer_state),
        reference.parameters,
        reference.gradient,
        strict=True,
    ):
        size = np.abs(slope).max()
        np.testing.assert_allclose(found / published_share, slope, rtol=2e-4, atol=2e-5 * size)
        clear = np.abs(slope) > 1e-3 * size
        np.testing.assert_allclose(np.asarray(own)[clear], expected[clear], atol=1e-5)
        compared += clear.sum() / clear.size
    assert compared / len(reference.parameters) > 0.7


def test_the_critic_update_equals_the_one_in_torch(case):
    reference = torch_qsm.critic_update(TINY, case.before, case.batch, case.of_critic)
    np.testing.assert_allclose(2 * case.metrics["critic_loss"], reference.loss, rtol=1e-5)
    np.testing.assert_allclose(case.metrics["value"], reference.extra["value"], rtol=1e-4, atol=1e-6)
    assert float(case.metrics["saturated"]) == pytest.approx(reference.extra["saturated"])
    assert 0 < reference.extra["saturated"] < 1
    assert_learned_alike(
        case.after.critic.networks, case.after.critic_optimizer, reference, published_share=0.5
    )


def test_the_actor_update_equals_the_one_in_torch(case):
    seen = case.before._replace(critic=case.after.critic)
    reference = torch_qsm.actor_update(TINY, seen, case.batch, case.times, case.of_actor)
    np.testing.assert_allclose(case.metrics["actor_loss"], reference.loss, rtol=1e-4)
    length = np.sqrt(sum((slope**2).sum() for slope in reference.gradient))
    np.testing.assert_allclose(case.metrics["actor_gradient"], length, rtol=1e-4)
    largest = reference.extra["target_gradient_max"]
    np.testing.assert_allclose(case.metrics["target_gradient_max"], largest, rtol=1e-4)
    assert float(case.metrics["outside"]) == pytest.approx(reference.extra["outside"])
    assert_learned_alike(case.after.actor, case.after.actor_optimizer, reference)


def test_the_actor_is_matched_to_the_critics_just_updated_and_not_to_those_before(case):
    old = torch_qsm.actor_update(TINY, case.before, case.batch, case.times, case.of_actor)
    assert abs(float(case.metrics["actor_loss"]) / old.loss - 1) > 1e-3


def test_targets_move_by_the_target_rate_towards_the_critics_after_their_step(case):
    trees = case.before.critic.target, case.after.critic.networks, case.after.critic.target
    for old, online, new in zip(*map(jax.tree.leaves, trees), strict=True):
        np.testing.assert_allclose(new, 0.995 * old + 0.005 * online, atol=1e-6)


def test_the_actors_step_falls_along_a_cosine_to_nothing():
    config = replace(TINY, decay_updates=4)
    method = QSM(config, Spec(OBSERVATIONS, ACTIONS))
    step, state, sizes = jax.jit(method.update), jax.jit(method.init)(jax.random.key(0)), []
    for index in range(5):
        after, _ = step(state, BATCH, jax.random.key(0))
        moved = jax.tree.map(lambda new, old: abs(new - old).max(), after.actor, state.actor)
        sizes.append(float(max(jax.tree.leaves(moved))))
        assert int(after.updates) == index + 1
        state = after
    shares = [1.0, (1 + np.sqrt(0.5)) / 2, 0.5, (1 - np.sqrt(0.5)) / 2, 0.0]
    np.testing.assert_allclose(sizes, 3e-4 * np.array(shares), rtol=0.1, atol=1e-7)


def test_the_defaults_are_the_published_configuration():
    config = Config()
    assert (config.diffusion_steps, config.gradient_scale, config.smoothing) == (5, 50.0, 0.1)
    assert (config.actor_hidden_size, config.critic_hidden_size, config.discount) == (512, 512, 0.99)
    assert (config.actor_learning_rate, config.critic_learning_rate) == (3e-4, 3e-4)
    assert (config.decay_updates, config.target_rate) == (2_000_000, 0.005)


def test_rewards_that_overflow_leave_a_state_that_is_seen_not_to_be_finite():
    large = BATCH._replace(rewards=1e30 * BATCH.rewards)
    after, metrics = update(moved_state(), large, jax.random.key(0))
    assert not is_finite(after)
    assert first_bad_leaf(after).startswith("state.critic_optimizer[0].nu")
    assert np.isinf(metrics["critic_loss"])


def test_a_reward_that_is_not_a_number_reaches_the_actor():
    broken = BATCH._replace(rewards=jnp.full(ROWS, jnp.nan))
    after, _ = update(moved_state(), broken, jax.random.key(0))
    assert all(np.isnan(leaf).all() for leaf in jax.tree.leaves(after.critic.networks))
    action = jax.jit(METHOD.act)(after, BATCH.observations[0], jax.random.key(1))
    assert np.isnan(action).all()  # no clipping makes a number of it


def test_a_thousandfold_reward_shows_in_the_loss_and_stays_finite():
    large = BATCH._replace(rewards=1e3 * BATCH.rewards)
    after, metrics = update(moved_state(), large, jax.random.key(0))
    assert is_finite(after)
    expected = 1e6 * np.square(large.rewards / 1e3).mean()
    np.testing.assert_allclose(metrics["critic_loss"], expected, rtol=0.05)
