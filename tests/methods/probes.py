"""Probe problems whose value is known on paper, one difficulty each; fed to `update` as endless batches."""

from dataclasses import dataclass
from functools import cache, partial

import jax
from jax import numpy as jnp

from hcpg.types import Batch, Spec

ROWS, UPDATES, DISCOUNT = 64, 1000, 0.8
SPEC = Spec(observation_size=2, action_size=1)


@dataclass(frozen=True)
class Probe:
    """A problem: what an action earns, and whether the episode ends with it."""

    best: float
    """The reward is `constant - price * (a - best)^2`."""
    price: float
    constant: float
    terminated: float


@cache
def learner(method):
    """One compiled program for all probes: (probe's numbers, key) -> the state after all updates."""

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


def learned(method, probe):
    """The state of `method` (bound to SPEC and DISCOUNT) after UPDATES updates on the probe."""
    numbers = jnp.array([probe.best, probe.price, probe.constant, probe.terminated])
    return learner(method)(numbers, jax.random.key(0))


def values(method, state):
    """[20, 50]: of 50 random actions at 20 random observations."""
    keys = jax.random.split(jax.random.key(1), 2)
    observations = jax.random.normal(keys[0], (20, 2))
    actions = jax.random.uniform(keys[1], (50, 1), minval=-1, maxval=1)
    return valuer(method)(state, observations, actions)


@cache
def valuer(method):
    """One compiled program for all probes."""
    return jax.jit(jax.vmap(method.value, in_axes=(None, 0, None)))


def proposals(method, state):
    """[20, 50, 1]: 50 proposals at each of 20 random observations."""
    keys = jax.random.split(jax.random.key(2), 20)
    observations = jax.random.normal(jax.random.key(3), (20, 2))
    return proposer(method)(state, observations, keys)


@cache
def proposer(method):
    """One compiled program for all probes."""
    of_one = partial(method.propose, count=50)
    return jax.jit(jax.vmap(of_one, in_axes=(None, 0, 0)))
