"""Dense layers with layer normalisation between them: FlowRL's velocity field and its value towers."""

from collections.abc import Callable, Sequence
from functools import partial

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.dense import Dense, Initializer

Activation = Callable[[Array], Array]
EPSILON = 1e-5
XAVIER_UNIFORM: Initializer = jax.nn.initializers.glorot_uniform()
"""Uniform with variance 2 / (inputs + outputs)."""
GELU: Activation = partial(jax.nn.gelu, approximate=False)
"""`x` times the normal distribution function of `x`, not its tanh approximation."""


class LayerNorm(eqx.Module):
    """Each row to mean 0 and variance 1 over its features, then a learned gain and bias."""

    gain: Float[Array, "*stack features"]
    bias: Float[Array, "*stack features"]

    @classmethod
    def create(cls, features: int) -> "LayerNorm":
        """Gain 1, bias 0."""
        return cls(jnp.ones(features), jnp.zeros(features))

    def __call__(self, x: Float[Array, "*batch features"]) -> Float[Array, "*batch features"]:
        """The normalised rows."""
        centred = x - x.mean(axis=-1, keepdims=True)
        variance = jnp.square(centred).mean(axis=-1, keepdims=True)
        return centred * jax.lax.rsqrt(variance + EPSILON) * self.gain + self.bias


class LayerNormMLP(eqx.Module):
    """[dense -> LayerNorm -> activation] for every hidden layer, then dense."""

    layers: list[Dense]
    norms: list[LayerNorm]
    activations: tuple[Activation, ...] = eqx.field(static=True)

    @classmethod
    def create(
        cls, key: PRNGKeyArray, sizes: Sequence[int], activations: tuple[Activation, ...]
    ) -> "LayerNormMLP":
        """A fresh stack; `sizes` runs from inputs to outputs, with an activation for each hidden layer."""
        keys = jax.random.split(key, len(sizes) - 1)
        shapes = zip(keys, sizes[:-1], sizes[1:], strict=True)
        layers = [Dense.create(each, inputs, outputs, XAVIER_UNIFORM) for each, inputs, outputs in shapes]
        return cls(layers, [LayerNorm.create(size) for size in sizes[1:-1]], activations)

    def __call__(self, x: Float[Array, "*batch I"]) -> Float[Array, "*batch outputs"]:
        """The last layer's output, neither normalised nor activated."""
        for layer, norm, activation in zip(self.layers[:-1], self.norms, self.activations, strict=True):
            x = activation(norm(layer(x)))
        return self.layers[-1](x)


def velocity_field(key: PRNGKeyArray, inputs: int, action_size: int, hidden_size: int) -> LayerNormMLP:
    """Two hidden ELU layers.

    Source: FlowRL's official code.
    """
    return LayerNormMLP.create(key, (inputs, hidden_size, hidden_size, action_size), (jax.nn.elu,) * 2)


def value_tower(key: PRNGKeyArray, inputs: int, hidden_size: int) -> LayerNormMLP:
    """Four hidden layers, of which only the middle two are activated (GELU); one output.

    Source: FlowRL's official code.
    """
    linear = jax.nn.identity
    return LayerNormMLP.create(key, (inputs, *(hidden_size,) * 4, 1), (linear, GELU, GELU, linear))
