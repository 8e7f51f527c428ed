"""A dense layer for batches, initialised as LeCun normal (the flow recipe's default)."""

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray


class Dense(eqx.Module):
    """`x @ kernel + bias` over the last axis."""

    kernel: Float[Array, "*stack inputs outputs"]
    bias: Float[Array, "*stack outputs"]

    @classmethod
    def create(cls, key: PRNGKeyArray, inputs: int, outputs: int) -> "Dense":
        """A layer with a LeCun-normal kernel (variance 1 / inputs) and zero bias."""
        kernel = jax.nn.initializers.lecun_normal()(key, (inputs, outputs))
        return cls(kernel, jnp.zeros(outputs))

    @classmethod
    def constant(cls, inputs: int, outputs: int, bias: float) -> "Dense":
        """A layer that answers `bias` to every input, until it learns: zero kernel."""
        return cls(jnp.zeros((inputs, outputs)), jnp.full(outputs, bias))

    def __call__(self, x: Float[Array, "*batch inputs"]) -> Float[Array, "*batch outputs"]:
        """The layer's output."""
        return x @ self.kernel + self.bias
