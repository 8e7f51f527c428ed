"""Methods and readers so simple that a test can say by hand what they do; they train and act in no time."""

from typing import NamedTuple

import jax
from jax import numpy as jnp

from hcpg.types import Sampling, Scene, Spec


class Scalar(NamedTuple):
    """A state of one number."""

    level: jax.Array
    updates: jax.Array


class Follower:
    """Proposes `level + observation[0]` plus `noise` times uniform numbers; a value is minus the square."""

    config, sampling = None, Sampling()

    def __init__(self, noise=0.0, spec=Spec(3, 4)):  # noqa: B008  a NamedTuple never changes
        self.noise, self.spec = noise, spec

    def init(self, key):
        return Scalar(jnp.zeros(()), jnp.zeros((), jnp.int32))

    def propose(self, state, observation, key, count):
        drawn = jax.random.uniform(key, (count, self.spec.action_size), minval=-1, maxval=1)
        return state.level + observation[0] + self.noise * drawn

    def act(self, state, observation, key):
        return jnp.full(self.spec.action_size, state.level - observation[0])

    def value(self, state, observation, actions):
        return -jnp.square(actions).sum(axis=-1)

    def update(self, state, batch, key):
        level = state.level + batch.rewards.mean()
        updates = state.updates + 1
        delayed = jnp.where(updates % 2 == 0, level, jnp.nan)
        return Scalar(level, updates), {"level": level, "delayed": delayed, "luck": jax.random.uniform(key)}


class Reacher:
    """Moves the point suite's tool straight to the object, by at most 0.02 m an axis; has no critic."""

    config, spec, sampling = None, Spec(11, 4), Sampling()

    def init(self, key):
        return Scalar(jnp.zeros(()), jnp.zeros((), jnp.int32))

    def propose(self, state, observation, key, count):
        return jnp.tile(self.act(state, observation, key), (count, 1))

    def act(self, state, observation, key):
        move = jnp.clip((observation[4:7] - observation[0:3]) / 0.02, -1, 1)
        return jnp.append(move * (1 - state.level), -1.0)

    def update(self, state, batch, key):
        return state, {}


def read_scene(observation):
    """The tool at the origin, the object ahead along x, the goal beyond it."""
    ahead = jnp.array([1.0, 0.0, 0.0])
    return Scene.of(0 * ahead, ahead, 2 * ahead, observation[..., 1])
