"""A deterministic flow from bounded noise to an action, integrated by the midpoint rule."""

from collections.abc import Callable

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.layer_norm import LayerNormMLP, velocity_field


class MidpointFlow(eqx.Module):
    """A velocity field over (observation, sample, time), and the actions at the end of its paths.

    Source: FlowRL's official code.
    """

    field: LayerNormMLP
    flow_steps: int = eqx.field(static=True)

    @classmethod
    def create(
        cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_size: int, flow_steps: int
    ) -> "MidpointFlow":
        """A fresh flow for (observation, action) `sizes`."""
        return cls(velocity_field(key, sum(sizes) + 1, sizes[1], hidden_size), flow_steps)

    def velocity(
        self,
        observations: Float[Array, "*batch O"],
        samples: Float[Array, "*batch A"],
        times: Float[Array, "*batch"],
    ) -> Float[Array, "*batch A"]:
        """The field at `samples`; it sees the bare time in [0, 1]."""
        return self.field(jnp.concatenate([observations, samples, times[..., None]], axis=-1))

    def actions(
        self, observations: Float[Array, "*batch O"], start: Float[Array, "*batch A"]
    ) -> Float[Array, "*batch A"]:
        """Where the paths from `start` end, put through tanh: in [-1, 1]."""

        def velocity(samples: Array, time: float) -> Array:
            return self.velocity(observations, samples, jnp.full(samples.shape[:-1], time))

        return jnp.tanh(integrate(velocity, start, self.flow_steps))

    def matching_errors(
        self,
        observations: Float[Array, "B O"],
        actions: Float[Array, "B A"],
        start: Float[Array, "B A"],
        times: Float[Array, " B"],
    ) -> Float[Array, " B"]:
        """Mean squared difference, over the action, from the straight line that ends at `actions`.

        The line ends at the action itself although tanh comes after the path: as published.

        Source: FlowRL's conditional flow matching.
        """
        share = times[:, None]
        between = share * actions + (1 - share) * start
        difference = self.velocity(observations, between, times) - (actions - start)
        return jnp.square(difference).mean(axis=-1)


def integrate(
    velocity: Callable[[Array, float], Array], start: Float[Array, "*batch A"], steps: int
) -> Float[Array, "*batch A"]:
    """Where `start` is after time 1: each step follows the velocity found half a step ahead."""
    samples = start
    for step in range(steps):
        time = step / steps
        half_way = samples + velocity(samples, time) / (2 * steps)
        samples = samples + velocity(half_way, time + 0.5 / steps) / steps
    return samples


def clamped_normal(key: PRNGKeyArray, shape: tuple[int, ...]) -> Float[Array, "*shape"]:
    """Standard normal numbers clamped to [-1, 1]: 32% of them lie on the bounds."""
    return jnp.clip(jax.random.normal(key, shape), -1.0, 1.0)
