"""The flow actor with the gated velocity (Flow-G) and a deviation that the observation alone decides."""

from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from hcpg.networks.dense import Dense
from hcpg.networks.flow import FlowActor, Normalise, Push, step_times
from hcpg.networks.gaussian import bounded_log_deviation
from hcpg.networks.velocity import FieldMoments, GatedVelocity


class GatedDrive(NamedTuple):
    """What all steps of one flow share."""

    hidden: Float[Array, "M *state H"]
    log_deviation: Float[Array, "*state A"]


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


class GatedActor(FlowActor):
    """The gated field, which pulls the sample towards a candidate, and one deviation for all steps."""

    field: GatedVelocity
    deviation: Deviation

    @classmethod
    def create(cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_size: int) -> "GatedActor":
        """A fresh actor for (observation, action) `sizes`."""
        of_field, of_deviation = jax.random.split(key)
        return cls(
            GatedVelocity.create(of_field, *sizes, hidden_size),
            Deviation.create(of_deviation, *sizes, hidden_size),
        )

    def cloning_part(self, gradient: PyTree) -> PyTree:
        """All but the gate's, which stays as open as it is: the candidate alone can give any velocity.

        Where actions come in two modes, the best constant velocity late in the path is none. A gate that
        learns finds that first; and through a closed gate the candidate learns nothing any more.
        """
        gate = jax.tree.map(jnp.zeros_like, gradient.field.gate)
        return eqx.tree_at(lambda actor: actor.field.gate, gradient, gate)

    def moments(self) -> FieldMoments:
        """Fresh statistics of observation and sample."""
        return self.field.moments()

    def begin(
        self,
        moments: FieldMoments,
        observations: Float[Array, "*state O"],
        flow_steps: int,
        normalise: Normalise,
    ) -> tuple[GatedDrive, FieldMoments]:
        """The first layer's share of the observation and of all times, and the deviation."""
        norm = self.field.observation_norm
        normalised, seen = normalise(norm, moments.observation, observations, flow_steps)
        hidden = self.field.drive(normalised, step_times(flow_steps))
        drive = GatedDrive(hidden, self.deviation.log(observations))
        return drive, moments._replace(observation=seen)

    def push(
        self,
        drive: GatedDrive,
        step: int,
        sample: Float[Array, "*batch A"],
        moments: FieldMoments,
        normalise: Normalise,
    ) -> tuple[Push, FieldMoments]:
        """Gate times (candidate - sample); the steps share one norm of the sample."""
        inputs, seen = normalise(self.field.sample_norm, moments.sample, sample)
        velocity = self.field.velocity(drive.hidden[step], inputs, sample)
        return Push(velocity, drive.log_deviation, drive.log_deviation), moments._replace(sample=seen)
