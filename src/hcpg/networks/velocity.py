"""The gated velocity field (Flow-G): a gate pulls the sample towards a candidate action."""

from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.batch_renorm import BatchRenorm, Moments
from hcpg.networks.dense import Dense, swish

TIME_FREQUENCIES = 16
TIME_HIDDEN = 64
TIME_SIZE = 32
OPEN_GATE_BIAS = 5.0


class FieldMoments(NamedTuple):
    """Running statistics of the field's inputs."""

    observation: Moments
    sample: Moments


class GatedVelocity(eqx.Module):
    """v = z * (h - x), gate z and candidate h both from (observation, x, t).

    The observation and the time enter the first layer linearly, so their share of it is computed once
    per flow, not once per step. Gate and candidate share one matrix product: `inner` holds the gate's
    hidden units first, then the candidate's.

    Source: SAC-Flow, the velocity reparameterisation "Flow-G" behind the paper's equation (1).
    """

    observation_norm: BatchRenorm
    sample_norm: BatchRenorm
    time_inner: Dense
    time_outer: Dense
    inner: Dense
    gate: Dense
    candidate: Dense

    @classmethod
    def create(
        cls, key: PRNGKeyArray, observation_size: int, action_size: int, hidden_size: int
    ) -> "GatedVelocity":
        """A field whose gate starts open: z = sigmoid(5) = 0.9933 everywhere."""
        keys = jax.random.split(key, 5)
        inputs = observation_size + action_size + TIME_SIZE
        halves = [Dense.create(each, inputs, hidden_size) for each in keys[:2]]
        return cls(
            observation_norm=BatchRenorm.create(observation_size),
            sample_norm=BatchRenorm.create(action_size),
            time_inner=Dense.create(keys[2], 2 * TIME_FREQUENCIES, TIME_HIDDEN),
            time_outer=Dense.create(keys[3], TIME_HIDDEN, TIME_SIZE),
            inner=jax.tree.map(lambda *each: jnp.concatenate(each, axis=-1), *halves),
            gate=Dense.constant(hidden_size, action_size, OPEN_GATE_BIAS),
            candidate=Dense.create(keys[4], hidden_size, action_size),
        )

    def moments(self) -> FieldMoments:
        """Fresh statistics for this field."""
        observation_size, action_size = self.observation_norm.bias.size, self.sample_norm.bias.size
        return FieldMoments(Moments.create(observation_size), Moments.create(action_size))

    def drive(
        self, normalised: Float[Array, "*batch O"], times: Float[Array, " M"]
    ) -> Float[Array, "M *batch H"]:
        """The first layer's share that does not depend on the sample, for all steps at once."""
        observation_size = normalised.shape[-1]
        features = self.time_outer(swish(self.time_inner(_fourier(times))))
        of_time = features @ self.inner.kernel[-TIME_SIZE:] + self.inner.bias
        of_observation = normalised @ self.inner.kernel[:observation_size]
        axes = (slice(None),) + (None,) * (normalised.ndim - 1)
        return of_observation[None] + of_time[axes]

    def velocity(
        self,
        drive: Float[Array, "*state H"],
        normalised: Float[Array, "*batch A"],
        sample: Float[Array, "*batch A"],
    ) -> Float[Array, "*batch A"]:
        """The velocity at one step, from that step's `drive` and the (normalised) sample."""
        observation_size, action_size = self.observation_norm.bias.size, sample.shape[-1]
        kernel = self.inner.kernel[observation_size : observation_size + action_size]
        hidden = swish(drive + normalised @ kernel)
        of_gate, of_candidate = jnp.split(hidden, 2, axis=-1)
        gate = jax.nn.sigmoid(self.gate(of_gate))
        return gate * (self.candidate(of_candidate) - sample)


def _fourier(times: Float[Array, " M"]) -> Float[Array, "M F"]:
    frequencies = jnp.logspace(0, -4, TIME_FREQUENCIES)
    angles = times[:, None] * frequencies
    return jnp.concatenate([jnp.sin(angles), jnp.cos(angles)], axis=-1)
