"""From noise to actions: an exported flow, or an exported Gaussian."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from hcpg.loops.control.deployed.fields import FIELDS, Field
from hcpg.loops.control.deployed.layers import Layers, relu, through
from hcpg.loops.control.deployed.parcel import PolicyFolderError
from hcpg.types import Float

GAUSSIAN = "gaussian"


@runtime_checkable
class Actor(Protocol):
    """A network that makes actions in [-1, 1] of one observation."""

    draws: int
    """How many standard normal numbers an action's every coordinate takes."""

    def actions(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D K A"]
    ) -> Float[np.ndarray, "K A"]:
        """The K actions that the noise leads to."""
        ...

    def own(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D 1 A"]
    ) -> Float[np.ndarray, " A"]:
        """What it does where nobody selects."""
        ...


class Bounds:
    """Where tanh keeps the logarithm of a deviation."""

    def __init__(self, low: float, high: float) -> None:
        self._low, self._half = low, 0.5 * (high - low)

    def deviation(self, raw: Float[np.ndarray, "*rows A"]) -> Float[np.ndarray, "*rows A"]:
        """The deviation behind a network's raw output."""
        return np.exp(self._low + self._half * (np.tanh(raw) + 1.0))


class Flow:
    """Euler steps along a field, with noise on the way: what `hcpg.networks.flow` does at rest."""

    def __init__(self, field: Field, flow_steps: int, bounds: Bounds) -> None:
        self.draws = flow_steps + 1
        self._field, self._steps, self._bounds = field, flow_steps, bounds

    def actions(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D K A"]
    ) -> Float[np.ndarray, "K A"]:
        """The ends of the paths, put through tanh."""
        shared, samples = self._field.begin(observation), noise[0]
        for step in range(self._steps):
            push = self._field.push(shared, step, samples)
            deviation = self._bounds.deviation(push.raw_deviation) * self._field.noise_share
            samples = samples + push.velocity / self._steps + deviation * noise[step + 1]
        return np.tanh(samples)

    def own(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D 1 A"]
    ) -> Float[np.ndarray, " A"]:
        """One sample: a flow has no action in its middle."""
        return self.actions(observation, noise)[0]


class Gaussian:
    """tanh(mean + deviation * normal)."""

    draws = 1

    def __init__(self, layers: Layers, bounds: Bounds) -> None:
        self._network, self._bounds = layers.stack("actor.network.layers"), bounds

    def actions(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D K A"]
    ) -> Float[np.ndarray, "K A"]:
        """Independent samples."""
        mean, raw = np.split(through(self._network, observation, relu), 2)
        return np.tanh(mean + self._bounds.deviation(raw) * noise[0])

    def own(
        self, observation: Float[np.ndarray, " O"], noise: Float[np.ndarray, "D 1 A"]
    ) -> Float[np.ndarray, " A"]:
        """The mean, whatever the noise."""
        return np.tanh(np.split(through(self._network, observation, relu), 2)[0])


def actor_of(network: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Actor:
    """The actor that the facts describe and the arrays make up.

    Raises:
        PolicyFolderError: no such network is known here, or an array is missing.
    """
    kind, bounds = network["kind"], Bounds(*network["log_deviation_range"])
    layers = Layers(arrays, network["norm_epsilon"])
    if kind == GAUSSIAN:
        return Gaussian(layers, bounds)
    if kind not in FIELDS:
        known = ", ".join([*FIELDS, GAUSSIAN])
        raise PolicyFolderError(f"the policy has a network {kind!r}, and this version runs {known}")
    steps = network["flow_steps"]
    return Flow(FIELDS[kind](layers, steps), steps, bounds)
