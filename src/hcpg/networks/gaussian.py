"""A Gaussian actor whose actions tanh keeps within bounds, and the density that this gives them."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.mlp import MLP

LOG_DEVIATION_RANGE = (-5.0, 2.0)
LOG_SQRT_TWO_PI = 0.9189385332046727


class Sample(NamedTuple):
    """Actions and how likely they are."""

    actions: Float[Array, "*batch A"]
    """In (-1, 1)."""
    log_prob: Float[Array, "*batch"]
    """Log-density of the action itself, with the tanh correction."""


class TanhGaussian(NamedTuple):
    """tanh(mean + deviation * normal), independent in every action coordinate."""

    mean: Float[Array, "*batch A"]
    """Before tanh."""
    log_deviation: Float[Array, "*batch A"]

    def sample(self, noise: Float[Array, "*batch A"]) -> Sample:
        """The actions that standard normal `noise` leads to; it may have more leading axes than the mean."""
        before = self.mean + jnp.exp(self.log_deviation) * noise
        gaussian = -0.5 * jnp.square(noise) - self.log_deviation - LOG_SQRT_TWO_PI
        return Sample(jnp.tanh(before), (gaussian - tanh_log_slope(before)).sum(axis=-1))


class GaussianActor(eqx.Module):
    """One ReLU network with two outputs per action: the mean and the raw log-deviation."""

    network: MLP

    @classmethod
    def create(
        cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_sizes: Sequence[int]
    ) -> "GaussianActor":
        """A fresh actor for (observation, action) `sizes`."""
        observation_size, action_size = sizes
        return cls(MLP.create(key, [observation_size, *hidden_sizes, 2 * action_size]))

    def __call__(self, observations: Float[Array, "*batch O"]) -> TanhGaussian:
        """The distribution of the action for each observation."""
        mean, raw = jnp.split(self.network(observations), 2, axis=-1)
        return TanhGaussian(mean, bounded_log_deviation(raw))


def bounded_log_deviation(raw: Float[Array, "*batch A"]) -> Float[Array, "*batch A"]:
    """`raw` squashed into [-5, 2] by tanh, so that a gradient is left where a clip would have none."""
    low, high = LOG_DEVIATION_RANGE
    return low + 0.5 * (high - low) * (jnp.tanh(raw) + 1)


def tanh_log_slope(x: Float[Array, "*batch A"], half_range: float = 1.0) -> Float[Array, "*batch A"]:
    """Logarithm of the slope of `half_range * tanh(x)`, floored at log(1e-6).

    The slope is a product of sigmoids, since 1 - tanh(x)^2 has no digits left in float32 from |x| = 5 on.
    """
    slope = 4 * jax.nn.sigmoid(2 * x) * jax.nn.sigmoid(-2 * x)
    return jnp.log(half_range * slope + 1e-6)
