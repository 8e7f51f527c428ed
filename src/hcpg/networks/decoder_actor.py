"""The flow actor with the decoder field (Flow-T): a token of sample and time attends to the observation."""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.batch_renorm import BatchRenorm, Moments
from hcpg.networks.dense import Dense, swish
from hcpg.networks.flow import FlowActor, Normalise, Push, step_times
from hcpg.networks.gaussian import bounded_log_deviation
from hcpg.networks.mlp import MLP

Density = Literal["corrected", "as_published"]
LAYERS = 2
NORMS_PER_LAYER = 3
WIDENING = 4


class DecoderMoments(NamedTuple):
    """Running statistics of every norm."""

    observation: Moments
    samples: list[Moments]
    """One for each flow step."""
    layers: list[list[Moments]]
    """Three for each decoder layer, shared by the flow steps."""


class DecoderDrive(NamedTuple):
    """What all steps of one flow share."""

    times: Float[Array, "M D"]
    """Token of each step's time."""
    memories: list[Float[Array, "*state D"]]
    """What each layer reads from the observation."""


class LoneAttention(eqx.Module):
    """Attention to a single key, whose softmax is 1 whatever the query: an affine map of the value.

    Queries, keys and the number of heads have no influence and would get no gradient, so there are none.
    """

    value: Dense
    output: Dense

    @classmethod
    def create(cls, key: PRNGKeyArray, size: int) -> "LoneAttention":
        """Value and output projection of one token of `size` numbers."""
        return cls(*(Dense.create(each, size, size) for each in jax.random.split(key)))

    def __call__(self, x: Float[Array, "*batch D"]) -> Float[Array, "*batch D"]:
        """What is read from the token `x`."""
        return self.output(self.value(x))


class DecoderLayer(eqx.Module):
    """Attention to itself, to the observation, and a feed-forward part; each is added, then normalised."""

    to_itself: LoneAttention
    to_observation: LoneAttention
    widen: Dense
    narrow: Dense
    norms: list[BatchRenorm]

    @classmethod
    def create(cls, key: PRNGKeyArray, size: int) -> "DecoderLayer":
        """A layer for tokens of `size` numbers, with a hidden layer four times as wide."""
        keys = jax.random.split(key, 4)
        return cls(
            LoneAttention.create(keys[0], size),
            LoneAttention.create(keys[1], size),
            Dense.create(keys[2], size, WIDENING * size),
            Dense.create(keys[3], WIDENING * size, size),
            [BatchRenorm.create(size) for _ in range(NORMS_PER_LAYER)],
        )

    def __call__(
        self,
        token: Float[Array, "*batch D"],
        memory: Float[Array, "*state D"],
        moments: list[Moments],
        normalise: Normalise,
    ) -> tuple[Float[Array, "*batch D"], list[Moments]]:
        """The token after the layer; `memory` is what `to_observation` read."""
        token, first = normalise(self.norms[0], moments[0], token + self.to_itself(token))
        token, second = normalise(self.norms[1], moments[1], token + memory)
        fed = self.narrow(jax.nn.gelu(self.widen(token)))
        token, third = normalise(self.norms[2], moments[2], token + fed)
        return token, [first, second, third]


class DecoderActor(FlowActor):
    """Flow-T: velocity and deviation from two decoder layers over one token.

    The noise is drawn in velocity space, so the sample's deviation is the network's over the number of
    steps. Each step has its own norm of the sample; the layers' norms are shared. All rows of a step have
    the same time token, so in training the first norm takes it out until its correction starts after
    100,000 calls, while in acting it counts, untrained. Deviation: the path density counts the noise's
    deviation; published, the term is missing, so that entropy has no slope by it, and `density` brings that
    back.

    Source: SAC-Flow, the velocity reparameterisation "Flow-T".
    """

    observation_norm: BatchRenorm
    of_observation: MLP
    of_time: MLP
    sample_norms: list[BatchRenorm]
    of_sample: Dense
    layers: list[DecoderLayer]
    velocity: Dense
    deviation: Dense
    density: Density = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: PRNGKeyArray,
        sizes: tuple[int, int],
        size: int,
        flow_steps: int,
        density: Density = "corrected",
    ) -> "DecoderActor":
        """A fresh actor for (observation, action) `sizes` and tokens of `size` numbers."""
        (observation_size, action_size), keys = sizes, jax.random.split(key, 6)
        return cls(
            BatchRenorm.create(observation_size),
            MLP.create(keys[0], (observation_size, size // 2, size), swish),
            MLP.create(keys[1], (1, size // 4, size // 2, size), swish),
            [BatchRenorm.create(action_size) for _ in range(flow_steps)],
            Dense.create(keys[2], action_size, size),
            [DecoderLayer.create(each, size) for each in jax.random.split(keys[3], LAYERS)],
            Dense.create(keys[4], size, action_size),
            Dense.create(keys[5], size, action_size),
            density,
        )

    def moments(self) -> DecoderMoments:
        """Fresh statistics of every norm."""
        fresh = jax.tree.map(
            lambda norm: Moments.create(norm.bias.size),
            (self.observation_norm, self.sample_norms, [layer.norms for layer in self.layers]),
            is_leaf=lambda node: isinstance(node, BatchRenorm),
        )
        return DecoderMoments(*fresh)

    def begin(
        self,
        moments: DecoderMoments,
        observations: Float[Array, "*state O"],
        flow_steps: int,
        normalise: Normalise,
    ) -> tuple[DecoderDrive, DecoderMoments]:
        """The times' tokens, and what each layer reads from the observation."""
        normalised, seen = normalise(self.observation_norm, moments.observation, observations)
        memory = self.of_observation(normalised)
        times = self.of_time(step_times(flow_steps)[:, None])
        drive = DecoderDrive(times, [layer.to_observation(memory) for layer in self.layers])
        return drive, moments._replace(observation=seen)

    def push(
        self,
        drive: DecoderDrive,
        step: int,
        sample: Float[Array, "*batch A"],
        moments: DecoderMoments,
        normalise: Normalise,
    ) -> tuple[Push, DecoderMoments]:
        """Velocity and deviation at this sample, observation and time."""
        samples, layers = list(moments.samples), []
        normalised, samples[step] = normalise(self.sample_norms[step], samples[step], sample)
        token = self.of_sample(normalised) + drive.times[step]
        for layer, memory, before in zip(self.layers, drive.memories, moments.layers, strict=True):
            token, after = layer(token, memory, before, normalise)
            layers.append(after)
        log_deviation = bounded_log_deviation(self.deviation(token)) - jnp.log(len(self.sample_norms))
        counted = log_deviation if self.density == "corrected" else jnp.zeros_like(log_deviation)
        moved = moments._replace(samples=samples, layers=layers)
        return Push(self.velocity(token), log_deviation, counted), moved
