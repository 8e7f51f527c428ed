"""A small actor whose statistics, gate and norms are not those of the start, and one that is fresh."""

import equinox as eqx
import jax
import pytest

from hcpg.networks.batch_renorm import Moments
from hcpg.networks.gated_actor import GatedActor
from hcpg.networks.velocity import FieldMoments

OBSERVATIONS, ACTIONS, HIDDEN, STEPS = 5, 3, 8, 4


@pytest.fixture(scope="session")
def fresh_actor():
    return GatedActor.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), HIDDEN)


@pytest.fixture(scope="session")
def actor(fresh_actor):
    """Every parameter moved off its start, so that none can be left out unnoticed."""
    arrays, static = eqx.partition(fresh_actor, eqx.is_array)
    leaves, tree = jax.tree.flatten(arrays)
    keys = jax.random.split(jax.random.key(1), len(leaves))
    moved = [leaf + 0.1 * jax.random.normal(key, leaf.shape) for leaf, key in zip(leaves, keys, strict=True)]
    return eqx.combine(jax.tree.unflatten(tree, moved), static)


@pytest.fixture(scope="session")
def moments():
    """Running statistics as after some training."""
    keys = jax.random.split(jax.random.key(2), 4)

    def of(size, mean_key, variance_key):
        mean = jax.random.normal(mean_key, (size,))
        return Moments(
            mean, jax.random.uniform(variance_key, (size,), minval=0.5, maxval=2.0), jax.numpy.int32(9)
        )

    return FieldMoments(of(OBSERVATIONS, *keys[:2]), of(ACTIONS, *keys[2:]))
