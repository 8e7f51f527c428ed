"""The velocity fields of exported flows, as `hcpg.networks` has them, for one observation at a time.

What does not depend on the observation is computed once, when a field is made.
"""

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from hcpg.loops.control.deployed.layers import Dense, Layers, Norm, gelu, relu, sigmoid, swish, through
from hcpg.types import Float


class Push(NamedTuple):
    """What moves the samples in one step."""

    velocity: Float[np.ndarray, "K A"]
    raw_deviation: Float[np.ndarray, "*rows A"]
    """The network's output before it is bounded."""


@runtime_checkable
class Field(Protocol):
    """What moves K samples from noise to actions."""

    noise_share: float
    """What a step's deviation is multiplied by."""

    def begin(self, observation: Float[np.ndarray, " O"]) -> Any:
        """What the steps share, computed once per flow."""
        ...

    def push(self, shared: Any, step: int, samples: Float[np.ndarray, "K A"]) -> Push:
        """What moves the samples in step number `step`."""
        ...


def step_times(flow_steps: int) -> Float[np.ndarray, " M"]:
    """The time at which each step begins, in [0, 1)."""
    return np.arange(flow_steps) / flow_steps


class GatedField:
    """A gate pulls the samples towards a candidate action (Flow-G)."""

    noise_share = 1.0

    def __init__(self, layers: Layers, flow_steps: int) -> None:
        self._norm = layers.norm("actor.field.observation_norm", "moments.observation")
        self._sample_norm = layers.norm("actor.field.sample_norm", "moments.sample")
        inner = layers.dense("actor.field.inner")
        sizes = (len(self._norm.gain), len(self._sample_norm.gain))
        self._of_observation, self._of_sample, of_time = np.split(inner.kernel, np.cumsum(sizes))
        first, second = layers.dense("actor.field.time_inner"), layers.dense("actor.field.time_outer")
        features = second(swish(first(_waves(step_times(flow_steps), len(first.kernel) // 2))))
        self._times = features @ of_time + inner.bias
        self._gate, self._candidate = layers.dense("actor.field.gate"), layers.dense("actor.field.candidate")
        self._deviation = [layers.dense(f"actor.deviation.{name}") for name in ("first", "second", "last")]

    def begin(self, observation: Float[np.ndarray, " O"]) -> tuple[np.ndarray, np.ndarray]:
        """The first layer's share of observation and times, and the deviation."""
        hidden = self._norm(observation) @ self._of_observation + self._times
        return hidden, through(self._deviation, observation, relu)

    def push(
        self, shared: tuple[np.ndarray, np.ndarray], step: int, samples: Float[np.ndarray, "K A"]
    ) -> Push:
        """Gate times (candidate - sample)."""
        hidden = swish(shared[0][step] + self._sample_norm(samples) @ self._of_sample)
        of_gate, of_candidate = np.split(hidden, 2, axis=-1)
        return Push(sigmoid(self._gate(of_gate)) * (self._candidate(of_candidate) - samples), shared[1])


class PlainField:
    """One network says velocity and deviation of every step."""

    noise_share = 1.0

    def __init__(self, layers: Layers, flow_steps: int) -> None:
        self._times = step_times(flow_steps)
        count = layers.count("actor.norms")
        self._norms = [layers.norm(f"actor.norms.{i}", f"moments.inputs.{i}") for i in range(count)]
        self._first, self._second = layers.dense("actor.first"), layers.dense("actor.second")
        self._velocity, self._deviation = layers.dense("actor.velocity"), layers.dense("actor.deviation")

    def begin(self, observation: Float[np.ndarray, " O"]) -> np.ndarray:
        """The observation as it is: every step normalises it anew."""
        return observation

    def push(self, shared: np.ndarray, step: int, samples: Float[np.ndarray, "K A"]) -> Push:
        """From the observation, the samples and the time, side by side."""
        rows = len(samples)
        times = np.full((rows, 1), self._times[step])
        inputs = np.concatenate([np.tile(shared, (rows, 1)), samples, times], axis=-1)
        normalised = self._norms[step % len(self._norms)](inputs)
        hidden = relu(self._second(relu(self._first(normalised))))
        return Push(self._velocity(hidden), self._deviation(hidden))


class DecoderLayer:
    """Attention to itself, to the observation, and a feed-forward part; each is added, then normalised."""

    def __init__(self, layers: Layers, number: int) -> None:
        own = f"actor.layers.{number}"
        self._to_itself = [layers.dense(f"{own}.to_itself.{part}") for part in ("value", "output")]
        self._to_observation = [layers.dense(f"{own}.to_observation.{part}") for part in ("value", "output")]
        self._widen, self._narrow = layers.dense(f"{own}.widen"), layers.dense(f"{own}.narrow")
        self._norms = [layers.norm(f"{own}.norms.{i}", f"moments.layers.{number}.{i}") for i in range(3)]

    def memory(self, token: Float[np.ndarray, " D"]) -> Float[np.ndarray, " D"]:
        """What is read from the observation's token."""
        return _read(self._to_observation, token)

    def __call__(
        self, tokens: Float[np.ndarray, "K D"], memory: Float[np.ndarray, " D"]
    ) -> Float[np.ndarray, "K D"]:
        """The tokens after the layer."""
        tokens = self._norms[0](tokens + _read(self._to_itself, tokens))
        tokens = self._norms[1](tokens + memory)
        return self._norms[2](tokens + self._narrow(gelu(self._widen(tokens))))


class DecoderField:
    """A token of sample and time goes through layers that attend to the observation (Flow-T)."""

    def __init__(self, layers: Layers, flow_steps: int) -> None:
        self.noise_share = 1.0 / flow_steps
        self._norm = layers.norm("actor.observation_norm", "moments.observation")
        self._of_observation = layers.stack("actor.of_observation.layers")
        of_time = layers.stack("actor.of_time.layers")
        self._times = through(of_time, step_times(flow_steps)[:, None], swish)
        self._sample_norms: list[Norm] = [
            layers.norm(f"actor.sample_norms.{i}", f"moments.samples.{i}") for i in range(flow_steps)
        ]
        self._of_sample = layers.dense("actor.of_sample")
        self._layers = [DecoderLayer(layers, i) for i in range(layers.count("actor.layers"))]
        self._velocity, self._deviation = layers.dense("actor.velocity"), layers.dense("actor.deviation")

    def begin(self, observation: Float[np.ndarray, " O"]) -> list[np.ndarray]:
        """What each layer reads from the observation."""
        token = through(self._of_observation, self._norm(observation), swish)
        return [layer.memory(token) for layer in self._layers]

    def push(self, shared: list[np.ndarray], step: int, samples: Float[np.ndarray, "K A"]) -> Push:
        """From the token after the last layer."""
        tokens = self._of_sample(self._sample_norms[step](samples)) + self._times[step]
        for layer, memory in zip(self._layers, shared, strict=True):
            tokens = layer(tokens, memory)
        return Push(self._velocity(tokens), self._deviation(tokens))


FIELDS: dict[str, type[GatedField] | type[PlainField] | type[DecoderField]] = {
    "gated": GatedField,
    "plain": PlainField,
    "decoder": DecoderField,
}
"""By the name that `policy.json` has."""


def _read(attention: list[Dense], x: np.ndarray) -> np.ndarray:
    """Attention to a single key: an affine map of the value."""
    value, output = attention
    return output(value(x))


def _waves(times: Float[np.ndarray, " M"], frequencies: int) -> Float[np.ndarray, "M F"]:
    angles = times[:, None] * np.logspace(0, -4, frequencies)
    return np.concatenate([np.sin(angles), np.cos(angles)], axis=-1)
