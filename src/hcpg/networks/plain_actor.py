"""The flow actor without a gate: one network says velocity and deviation of every step."""

from typing import NamedTuple

import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.batch_renorm import BatchRenorm, Moments
from hcpg.networks.dense import Dense
from hcpg.networks.flow import FlowActor, Normalise, Push, step_times
from hcpg.networks.gaussian import bounded_log_deviation


class PlainMoments(NamedTuple):
    """Running statistics of the network's inputs: observation, sample and time, side by side."""

    inputs: list[Moments]
    """One for all steps, or one for each."""


class PlainDrive(NamedTuple):
    """What all steps of one flow share."""

    observations: Float[Array, "*state O"]
    times: Float[Array, " M"]


class PlainActor(FlowActor):
    """BRN(observation, x, t) -> two hidden ReLU layers -> heads for velocity and log-deviation.

    As published the steps share one norm, and the raw time goes through it. All rows of a step have the
    same time, so in training the norm turns it into its bias alone, until its correction starts after
    100,000 calls; in acting it is the distance to the running mean over a deviation that sinks to
    sqrt(0.001). So what acts is not what was trained. With a norm for each step it is: the running moments
    are then those of the batches it saw, and its bias tells the step's time.

    Source: the naive flow of SAC-Flow, its ablation of the gate; a norm for each step is ours.
    """

    norms: list[BatchRenorm]
    first: Dense
    second: Dense
    velocity: Dense
    deviation: Dense

    @classmethod
    def create(
        cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_size: int, norms: int = 1
    ) -> "PlainActor":
        """A fresh actor for (observation, action) `sizes`; `norms` is 1 or the number of flow steps."""
        keys = jax.random.split(key, 4)
        inputs, action_size = sum(sizes) + 1, sizes[1]
        return cls(
            [BatchRenorm.create(inputs) for _ in range(norms)],
            Dense.create(keys[0], inputs, hidden_size),
            Dense.create(keys[1], hidden_size, hidden_size),
            Dense.create(keys[2], hidden_size, action_size),
            Dense.create(keys[3], hidden_size, action_size),
        )

    def moments(self) -> PlainMoments:
        """Fresh statistics of the inputs."""
        return PlainMoments([Moments.create(norm.bias.size) for norm in self.norms])

    def begin(
        self,
        moments: PlainMoments,
        observations: Float[Array, "*state O"],
        flow_steps: int,
        normalise: Normalise,
    ) -> tuple[PlainDrive, PlainMoments]:
        """Observations and times as they are: every step normalises them anew."""
        return PlainDrive(observations, step_times(flow_steps)), moments

    def push(
        self,
        drive: PlainDrive,
        step: int,
        sample: Float[Array, "*batch A"],
        moments: PlainMoments,
        normalise: Normalise,
    ) -> tuple[Push, PlainMoments]:
        """Velocity and deviation at this sample, observation and time."""
        rows, observation_size = sample.shape[:-1], drive.observations.shape[-1]
        observations = jnp.broadcast_to(drive.observations, (*rows, observation_size))
        times = jnp.broadcast_to(drive.times[step], (*rows, 1))
        inputs = jnp.concatenate([observations, sample, times], axis=-1)
        seen, place = list(moments.inputs), step % len(self.norms)
        normalised, seen[place] = normalise(self.norms[place], seen[place], inputs)
        hidden = jax.nn.relu(self.second(jax.nn.relu(self.first(normalised))))
        log_deviation = bounded_log_deviation(self.deviation(hidden))
        return Push(self.velocity(hidden), log_deviation, log_deviation), PlainMoments(seen)
