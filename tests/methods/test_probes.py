"""Probe problems whose value is known on paper, one difficulty each; fed to `update` as endless batches."""

from dataclasses import dataclass
from functools import cache

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.methods.sac_flow import Config, SACFlow
from hcpg.types import Batch, Spec

ROWS, UPDATES, DISCOUNT = 64, 1000, 0.8


@dataclass(frozen=True)
class Probe:
    """A problem: what an action earns, and whether the episode ends with it."""

    best: float
    """The reward is `constant - price * (a - best)^2`."""
    price: float
    constant: float
    terminated: float


@cache
def bound(critic):
    config = Config(
        critic=critic,
        flow_steps=2,
        actor_hidden_size=16,
        critic_hidden_size=16,
        discount=DISCOUNT,
        actor_learning_rate=3e-3,
        critic_learning_rate=3e-3,
        policy_delay=1,
        initial_temperature=1e-6,
        target_rate=0.05,
    )
    return SACFlow(config, Spec(2, 1))


@cache
def learner(critic):
    """One compiled program for all probes: (probe's numbers, key) -> the state after all updates."""
    method = bound(critic)

    def batch(probe, key):
        keys = jax.random.split(key, 3)
        observations, following = jax.random.normal(keys[0], (2, ROWS, 2))
        actions = jax.random.uniform(keys[1], (ROWS, 1), minval=-1, maxval=1)
        best, price, constant, terminated = probe
        rewards = constant - price * jnp.square(actions[:, 0] - best)
        return Batch(observations, actions, rewards, following, jnp.full(ROWS, terminated))

    @jax.jit
    def learn(probe, key):
        def step(state, key):
            of_batch, of_update = jax.random.split(key)
            return method.update(state, batch(probe, of_batch), of_update)[0], None

        of_init, of_steps = jax.random.split(key)
        return jax.lax.scan(step, method.init(of_init), jax.random.split(of_steps, UPDATES))[0]

    return learn


def learned(critic, probe):
    numbers = jnp.array([probe.best, probe.price, probe.constant, probe.terminated])
    return learner(critic)(numbers, jax.random.key(0))


def values(critic, state):
    """Of 50 random actions at 20 random observations."""
    keys = jax.random.split(jax.random.key(1), 2)
    observations = jax.random.normal(keys[0], (20, 2))
    actions = jax.random.uniform(keys[1], (50, 1), minval=-1, maxval=1)
    return jax.jit(jax.vmap(bound(critic).value, in_axes=(None, 0, None)))(state, observations, actions)


@pytest.mark.parametrize("critic", ["crossq", "polyak"])
def test_a_reward_of_one_that_ends_the_episode_is_worth_one(critic):
    found = values(critic, learned(critic, Probe(best=0.0, price=0.0, constant=1.0, terminated=1.0)))
    np.testing.assert_allclose(found.mean(), 1.0, atol=0.05)
    assert float(abs(found - 1.0).max()) < 0.3


@pytest.mark.parametrize("critic", ["crossq", "polyak"])
def test_a_reward_of_one_cut_off_by_time_is_worth_all_that_would_follow(critic):
    found = values(critic, learned(critic, Probe(best=0.0, price=0.0, constant=1.0, terminated=0.0)))
    np.testing.assert_allclose(found.mean(), 1 / (1 - DISCOUNT), rtol=0.05)


@pytest.mark.parametrize("critic", ["crossq", "polyak"])
def test_the_actor_moves_to_the_action_that_earns_most(critic):
    state = learned(critic, Probe(best=0.5, price=1.0, constant=0.0, terminated=1.0))
    keys = jax.random.split(jax.random.key(2), 20)
    observations = jax.random.normal(jax.random.key(3), (20, 2))
    method = bound(critic)
    propose = jax.vmap(lambda observation, key: method.propose(state, observation, key, 50))
    actions = jax.jit(propose)(observations, keys)
    np.testing.assert_allclose(actions.mean(), 0.5, atol=0.07)
    assert float(actions.std()) < 0.2  # the fresh actor's is above 0.4
