"""A flow actor: noise carried to an action by Euler steps with learned noise on the way."""

from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.dense import Dense
from hcpg.networks.gaussian import LOG_SQRT_TWO_PI, bounded_log_deviation, tanh_log_slope
from hcpg.networks.velocity import FieldMoments, GatedVelocity


class Noise(NamedTuple):
    """All the randomness of a flow: its start, then one draw per step."""

    start: Float[Array, "*batch A"]
    steps: Float[Array, "M *batch A"]

    @classmethod
    def draw(cls, key: PRNGKeyArray, shape: tuple[int, ...], flow_steps: int) -> "Noise":
        """Standard normal numbers, independent over steps and samples."""
        every = jax.random.normal(key, (flow_steps + 1, *shape))
        return cls(every[0], every[1:])


class Path(NamedTuple):
    """Where a flow ended, and how likely its whole path was."""

    actions: Float[Array, "*batch A"]
    """tanh of the end point, in (-1, 1)."""
    log_prob: Float[Array, "*batch"]
    """Log-density of the path (start and all steps) with the tanh correction: not the action's own."""


class Deviation(eqx.Module):
    """Standard deviation of the step noise, from the raw observation alone.

    It depends neither on the sample nor on the time, so a flow computes it once.
    """

    first: Dense
    second: Dense
    last: Dense

    @classmethod
    def create(
        cls, key: PRNGKeyArray, observation_size: int, action_size: int, hidden_size: int
    ) -> "Deviation":
        """Two hidden ReLU layers."""
        keys = jax.random.split(key, 3)
        return cls(
            Dense.create(keys[0], observation_size, hidden_size),
            Dense.create(keys[1], hidden_size, hidden_size),
            Dense.create(keys[2], hidden_size, action_size),
        )

    def log(self, observations: Float[Array, "*batch O"]) -> Float[Array, "*batch A"]:
        """Logarithm of the deviation, within [-5, 2]."""
        hidden = jax.nn.relu(self.second(jax.nn.relu(self.first(observations))))
        return bounded_log_deviation(self.last(hidden))


class FlowActor(eqx.Module):
    """The velocity field and the step noise of one policy.

    Source: paper, equations (1) and (2). Deviation: as in SAC-Flow's code each step adds noise
    `deviation * normal` (no square root of the step size), and tanh bounds the action.
    """

    field: GatedVelocity
    deviation: Deviation
    flow_steps: int = eqx.field(static=True)

    @classmethod
    def create(
        cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_size: int, flow_steps: int
    ) -> "FlowActor":
        """A fresh actor for (observation, action) `sizes`."""
        of_field, of_deviation = jax.random.split(key)
        return cls(
            GatedVelocity.create(of_field, *sizes, hidden_size),
            Deviation.create(of_deviation, *sizes, hidden_size),
            flow_steps,
        )

    def infer(self, moments: FieldMoments, observations: Float[Array, "*batch O"], noise: Noise) -> Path:
        """Paths under the running statistics; `noise` may have more leading axes than needed."""
        field = self.field
        normalised = field.observation_norm.infer(moments.observation, observations)
        drive = field.drive(normalised, self._times())
        log_deviation = self.deviation.log(observations)
        sample = noise.start
        for step in range(self.flow_steps):
            inputs = field.sample_norm.infer(moments.sample, sample)
            velocity = field.velocity(drive[step], inputs, sample)
            sample = self._advance(sample, velocity, log_deviation, noise.steps[step])
        return Path(jnp.tanh(sample), path_log_prob(noise, log_deviation, sample))

    def train(
        self, moments: FieldMoments, observations: Float[Array, "B O"], noise: Noise
    ) -> tuple[Path, FieldMoments]:
        """Paths under the batch's statistics, and the running statistics after them."""
        field, steps = self.field, self.flow_steps
        normalised, seen = field.observation_norm.train(moments.observation, observations, steps)
        drive = field.drive(normalised, self._times())
        log_deviation = self.deviation.log(observations)
        sample, of_sample = noise.start, moments.sample
        for step in range(steps):
            inputs, of_sample = field.sample_norm.train(of_sample, sample)
            velocity = field.velocity(drive[step], inputs, sample)
            sample = self._advance(sample, velocity, log_deviation, noise.steps[step])
        path = Path(jnp.tanh(sample), path_log_prob(noise, log_deviation, sample))
        return path, FieldMoments(seen, of_sample)

    def _times(self) -> Float[Array, " M"]:
        return jnp.arange(self.flow_steps) / self.flow_steps

    def _advance(
        self,
        sample: Float[Array, "*batch A"],
        velocity: Float[Array, "*batch A"],
        log_deviation: Float[Array, "*state A"],
        noise: Float[Array, "*batch A"],
    ) -> Float[Array, "*batch A"]:
        return sample + velocity / self.flow_steps + jnp.exp(log_deviation) * noise


def path_log_prob(
    noise: Noise, log_deviation: Float[Array, "*state A"], end: Float[Array, "*batch A"]
) -> Float[Array, "*batch"]:
    """Log-density of start and steps, less the log-determinant of tanh.

    A step's residual over its deviation is the drawn noise itself, so the density needs no residuals,
    and entropy reaches the parameters through the deviation and the tanh only.

    Source: SAC-Flow's path density, used by the paper as the original objective (section III-A).
    """
    flow_steps = noise.steps.shape[0]
    squares = jnp.square(noise.start) + jnp.square(noise.steps).sum(axis=0)
    gaussian = -0.5 * squares - flow_steps * log_deviation - (flow_steps + 1) * LOG_SQRT_TWO_PI
    return (gaussian - tanh_log_slope(end)).sum(axis=-1)
