"""SAC's update against an independent one in PyTorch; its temperature, delays, actions and defaults."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import jax
import numpy as np
import pytest
import torch_sac
from jax import numpy as jnp
from one_update import assert_learned_alike, gradient_of, move, transitions

from hcpg.methods.sac import POLICY_METRICS, SAC, Config, State
from hcpg.types import Batch, Spec

ROWS, OBSERVATIONS, ACTIONS = 8, 5, 3
TEMPERATURE = 0.3
TINY = Config(actor_hidden_size=8, critic_hidden_size=8, initial_temperature=TEMPERATURE)
BATCH = transitions(ROWS, OBSERVATIONS, ACTIONS)


class Case(NamedTuple):
    """One update of a moved state."""

    method: SAC
    before: State
    after: State
    metrics: dict
    batch: Batch
    noises: list
    """For the target's next actions, and for the actor's loss."""


@cache
def method_of(critic, **settings):
    return SAC(replace(TINY, critic=critic, **settings), Spec(OBSERVATIONS, ACTIONS))


@cache
def update_of(critic, **settings):
    return jax.jit(method_of(critic, **settings).update)


@cache
def moved_state(critic):
    """A state whose every parameter is off its start, so that none can be left out unnoticed."""

    state = jax.jit(method_of(critic).init)(jax.random.key(0))
    critics = state.critic._replace(
        networks=move(state.critic.networks, 1), target=move(state.critic.target, 2)
    )
    return state._replace(actor=move(state.actor, 3), critic=critics)


@pytest.fixture(scope="module", params=["plain", "crossq"])
def case(request):
    before, key = moved_state(request.param), jax.random.key(9)
    after, metrics = update_of(request.param)(before, BATCH, key)
    noises = [jax.random.normal(each, (ROWS, ACTIONS)) for each in jax.random.split(key)]
    return Case(method_of(request.param), before, after, metrics, BATCH, noises)


def test_the_critic_update_equals_the_one_in_torch(case):
    reference = torch_sac.critic_update(case.method.config, case.before, case.batch, case.noises[0])
    np.testing.assert_allclose(case.metrics["critic_loss"], reference.loss, rtol=1e-5)
    np.testing.assert_allclose(case.metrics["value"], reference.mean, rtol=1e-4, atol=1e-6)
    assert_learned_alike(case.after.critic.networks, case.after.critic_optimizer, reference, share=0.6)


def test_the_actor_update_equals_the_one_in_torch(case):
    seen = case.before._replace(critic=case.after.critic)
    reference = torch_sac.actor_update(case.method.config, seen, case.batch, case.noises[1])
    np.testing.assert_allclose(case.metrics["actor_loss"], reference.loss, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(case.metrics["entropy"], reference.mean, rtol=1e-4)
    norm = np.sqrt(sum((slope**2).sum() for slope in reference.gradient))
    np.testing.assert_allclose(case.metrics["actor_gradient"], norm, rtol=1e-4)
    assert_learned_alike(case.after.actor, case.after.actor_optimizer, reference, share=0.6)


def test_targets_move_by_the_target_rate_after_the_step(case):
    trees = case.before.critic.target, case.after.critic.networks, case.after.critic.target
    if case.method.config.critic == "crossq":
        assert case.after.critic.target == ()
        return
    for old, online, new in zip(*map(jax.tree.leaves, trees), strict=True):
        np.testing.assert_allclose(new, 0.995 * old + 0.005 * online, atol=1e-6)


def test_the_temperature_sees_the_entropy_above_minus_three_and_nothing_of_the_actor_loss(case):
    """Its gradient is temperature * (entropy + 3): the actor loss would add -temperature * entropy."""
    entropy = float(case.metrics["entropy"])
    slope = TEMPERATURE * (entropy + ACTIONS)
    assert abs(TEMPERATURE * entropy) > 0.1
    np.testing.assert_allclose(gradient_of(case.after.temperature_optimizer), [slope], rtol=1e-4)
    step = -np.sign(slope) * 3e-4
    np.testing.assert_allclose(case.after.log_temperature - case.before.log_temperature, step, rtol=1e-3)
    np.testing.assert_allclose(case.metrics["temperature"], TEMPERATURE * np.exp(step), rtol=1e-5)


def test_the_target_entropy_is_minus_the_tasks_action_size_unless_given():
    for size in (1, 4, 7):
        assert SAC(Config(), Spec(observation_size=39, action_size=size)).target_entropy == -size
    assert SAC(Config(target_entropy=0.0), Spec(39, 4)).target_entropy == 0.0


def test_a_delay_of_three_trains_actor_and_temperature_once_in_three_updates():
    update, state = update_of("plain", policy_delay=3), moved_state("plain")
    first = state.actor
    for index in range(3):
        state, metrics = update(state, BATCH, jax.random.key(index))
        still = jax.tree.map(np.array_equal, state.actor, first)
        assert all(jax.tree.leaves(still)) == (index < 2)
        assert all(np.isnan(metrics[name]) == (index < 2) for name in POLICY_METRICS)
    optimizers = state.critic_optimizer, state.actor_optimizer, state.temperature_optimizer
    assert [int(each[0].count) for each in optimizers] == [3, 1, 1]


def test_the_evaluation_action_is_the_mean_through_tanh_whatever_the_key():
    method, state, observation = method_of("plain"), moved_state("plain"), BATCH.observations[0]
    one, other = (method.act(state, observation, jax.random.key(seed)) for seed in (0, 1))
    np.testing.assert_array_equal(one, other)
    proposals = method.propose(state, observation, jax.random.key(2), 4001)
    # tanh keeps order, so tanh of the mean is the median of the samples.
    spread = proposals.std(axis=0)
    assert (abs(np.median(proposals, axis=0) - one) < 0.1 * spread).all()  # 5 standard errors
    assert float(spread.min()) > 0.005


def test_proposals_of_one_set_are_independent():
    method, state, observation = method_of("plain"), moved_state("plain"), BATCH.observations[0]
    proposals = np.asarray(method.propose(state, observation, jax.random.key(3), 4000)).reshape(
        2000, 2, ACTIONS
    )
    for action in range(ACTIONS):
        assert abs(np.corrcoef(proposals[:, 0, action], proposals[:, 1, action])[0, 1]) < 4 / np.sqrt(2000)
    first, second = np.corrcoef(proposals[:, 0], rowvar=False)[0, 1:]
    assert max(abs(first), abs(second)) < 4 / np.sqrt(2000)


def test_the_value_is_the_smaller_critics_of_each_action(case):
    observation, actions = case.batch.observations[0], case.batch.actions
    rows = jnp.concatenate([jnp.tile(observation, (ROWS, 1)), actions], axis=-1)
    both = case.method.critics.values(case.before.critic, rows)
    assert (both[0] < both[1]).any() or (both[1] < both[0]).any()
    found = case.method.value(case.before, observation, actions)
    np.testing.assert_allclose(found, np.min(both, axis=0), rtol=1e-5)


def test_the_defaults_are_the_classical_recipe():
    config = Config()
    assert (config.critic, config.actor_hidden_size, config.critic_hidden_size) == ("plain", 256, 256)
    rates = config.actor_learning_rate, config.critic_learning_rate, config.temperature_learning_rate
    assert rates == (3e-4, 3e-4, 3e-4)
    assert (config.momentum, config.discount, config.target_rate) == (0.9, 0.99, 0.005)
    assert (config.policy_delay, config.initial_temperature, config.target_entropy) == (1, 1.0, None)
    state = jax.eval_shape(SAC(config, Spec(39, 4)).init, jax.random.key(0))
    layers = state.actor.network.layers
    assert [layer.kernel.shape for layer in layers] == [(39, 256), (256, 256), (256, 256), (256, 8)]
    twins = [layer.kernel.shape for layer in state.critic.networks.layers]
    assert twins == [(2, 43, 256), (2, 256, 256), (2, 256, 256), (2, 256, 1)]
