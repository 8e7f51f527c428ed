"""A dense layer for batches; LeCun normal (the flow recipe's default) unless told otherwise."""

from collections.abc import Callable

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

Initializer = Callable[[PRNGKeyArray, tuple[int, int]], Float[Array, "inputs outputs"]]
LECUN_NORMAL: Initializer = jax.nn.initializers.lecun_normal()
"""Variance 1 / inputs."""
NARROW = 8
"""Outputs up to which `narrow_product` is worth it."""


class Dense(eqx.Module):
    """`x @ kernel + bias` over the last axis."""

    kernel: Float[Array, "*stack inputs outputs"]
    bias: Float[Array, "*stack outputs"]

    @classmethod
    def create(
        cls, key: PRNGKeyArray, inputs: int, outputs: int, initializer: Initializer = LECUN_NORMAL
    ) -> "Dense":
        """A layer with a random kernel and zero bias."""
        return cls(initializer(key, (inputs, outputs)), jnp.zeros(outputs))

    @classmethod
    def constant(cls, inputs: int, outputs: int, bias: float) -> "Dense":
        """A layer that answers `bias` to every input, until it learns: zero kernel."""
        return cls(jnp.zeros((inputs, outputs)), jnp.full(outputs, bias))

    def __call__(self, x: Float[Array, "*batch inputs"]) -> Float[Array, "*batch outputs"]:
        """The layer's output."""
        if x.ndim == 2 and self.kernel.shape[-1] <= NARROW:
            return narrow_product(x, self.kernel) + self.bias
        return x @ self.kernel + self.bias


@jax.custom_vjp
def narrow_product(x: Float[Array, "B I"], kernel: Float[Array, "I A"]) -> Float[Array, "B A"]:
    """`x @ kernel` for a few outputs, whose kernel gradient is computed the fast way round.

    XLA's CPU backend needs ten times as long for x^T g as for (g^T x)^T when g is narrow; the barrier keeps
    it from turning the one into the other.
    """
    return x @ kernel


def _forward(x: Float[Array, "B I"], kernel: Float[Array, "I A"]) -> tuple[Array, tuple[Array, Array]]:
    return x @ kernel, (x, kernel)


def _backward(kept: tuple[Array, Array], gradient: Float[Array, "B A"]) -> tuple[Array, Array]:
    x, kernel = kept
    turned = jax.lax.dot_general(gradient, x, (((0,), (0,)), ((), ())))
    return gradient @ kernel.T, jax.lax.optimization_barrier(turned).T


narrow_product.defvjp(_forward, _backward)


@jax.custom_vjp
def swish(x: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """`x * sigmoid(x)`; the sigmoid is kept for the backward pass, where XLA would compute it many times."""
    return x * _sigmoid(x)


def _swish_forward(x: Array) -> tuple[Array, tuple[Array, Array]]:
    gate = jax.lax.optimization_barrier(_sigmoid(x))
    return x * gate, (x, gate)


def _swish_backward(kept: tuple[Array, Array], gradient: Array) -> tuple[Array]:
    x, gate = kept
    return (gradient * gate * (1 + x * (1 - gate)),)


swish.defvjp(_swish_forward, _swish_backward)


def _sigmoid(x: Array) -> Array:
    return 0.5 * jnp.tanh(0.5 * x) + 0.5  # tanh is the faster function on a CPU
