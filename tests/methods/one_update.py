"""One update of a method against an independent one: a state off its start, transitions, the comparison."""

import jax
import numpy as np
from jax import numpy as jnp

from hcpg.types import Batch

BETA_1 = 0.9
"""Adam's usual decay: after one step the first moment is a tenth of the gradient."""


def move(tree, seed, by=0.1):
    """The tree with every number off its start, so that none can be left out unnoticed."""
    leaves, structure = jax.tree.flatten(tree)
    generator = np.random.default_rng(seed)
    moved = [leaf + by * generator.normal(size=leaf.shape).astype(np.float32) for leaf in leaves]
    return jax.tree.unflatten(structure, moved)


def transitions(rows, observations, actions):
    """A random batch in which every fourth episode ends."""
    generator = np.random.default_rng(6)
    parts = [generator.normal(size=(rows, observations)), generator.uniform(-1, 1, (rows, actions))]
    parts += [generator.normal(size=rows), generator.normal(size=(rows, observations))]
    parts += [np.arange(rows) % 4 == 0]
    return Batch(*(jnp.asarray(each, jnp.float32) for each in parts))


def gradient_of(optimizer_state, beta_1=BETA_1):
    """The gradient that Adam's first moment holds after its first step."""
    return [np.asarray(leaf) / (1 - beta_1) for leaf in jax.tree.leaves(optimizer_state[0].mu)]


def assert_learned_alike(
    parameters, optimizer_state, reference, *, beta_1=BETA_1, share=0.7, rtol=1e-4, atol=1e-5, step_atol=1e-5
):
    """Gradients, and the parameters wherever the gradient is not so small that Adam's step is its noise.

    `share` of the numbers at least must have such a gradient, so that the comparison is one.
    """
    compared, gradients = 0, gradient_of(optimizer_state, beta_1)
    for own, slope, expected, expected_slope in zip(
        jax.tree.leaves(parameters), gradients, reference.parameters, reference.gradient, strict=True
    ):
        np.testing.assert_allclose(slope, expected_slope, rtol=rtol, atol=atol)
        clear = np.abs(expected_slope) > 1e-4
        np.testing.assert_allclose(np.asarray(own)[clear], expected[clear], atol=step_atol)
        compared += clear.sum() / clear.size
    assert compared / len(gradients) > share
