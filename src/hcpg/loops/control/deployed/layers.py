"""The layers that exported networks are made of, looked up by the names of their arrays; in float64."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hcpg.loops.control.deployed.parcel import AGAIN, PolicyFolderError
from hcpg.types import Float

Activation = Callable[[np.ndarray], np.ndarray]


class Dense(NamedTuple):
    """`x @ kernel + bias`."""

    kernel: Float[np.ndarray, "inputs outputs"]
    bias: Float[np.ndarray, " outputs"]

    def __call__(self, x: Float[np.ndarray, "*batch inputs"]) -> Float[np.ndarray, "*batch outputs"]:
        """The layer's output."""
        return x @ self.kernel + self.bias


class Norm(NamedTuple):
    """Batch renormalisation by its running moments, folded into a gain and an offset."""

    gain: Float[np.ndarray, " F"]
    offset: Float[np.ndarray, " F"]

    def __call__(self, x: Float[np.ndarray, "*batch F"]) -> Float[np.ndarray, "*batch F"]:
        """The normalised rows."""
        return x * self.gain + self.offset


class Layers:
    """The arrays of a folder, as the layers that they make up."""

    def __init__(self, arrays: Mapping[str, np.ndarray], norm_epsilon: float) -> None:
        self._arrays, self._epsilon = arrays, norm_epsilon

    def dense(self, name: str) -> Dense:
        """The dense layer of that name."""
        return Dense(self._array(f"{name}.kernel"), self._array(f"{name}.bias"))

    def stack(self, name: str) -> list[Dense]:
        """The numbered dense layers under that name, in order."""
        return [self.dense(f"{name}.{number}") for number in range(self.count(name))]

    def norm(self, name: str, moments: str) -> Norm:
        """The norm of that name, with its running statistics."""
        scale, bias = self._array(f"{name}.scale"), self._array(f"{name}.bias")
        gain = scale / np.sqrt(self._array(f"{moments}.variance") + self._epsilon)
        return Norm(gain, bias - self._array(f"{moments}.mean") * gain)

    def count(self, name: str) -> int:
        """How many numbered parts are under that name."""
        parts = {
            each[len(name) + 1 :].partition(".")[0] for each in self._arrays if each.startswith(f"{name}.")
        }
        return sum(part.isdecimal() for part in parts)

    def _array(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            raise PolicyFolderError(f"the policy's weights lack the array {name!r}. {AGAIN}")
        return self._arrays[name].astype(np.float64)


def through(layers: Sequence[Dense], x: np.ndarray, activation: Activation) -> np.ndarray:
    """[dense -> activation] for every layer but the last, then that."""
    for layer in layers[:-1]:
        x = activation(layer(x))
    return layers[-1](x)


def relu(x: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """What is above 0."""
    return np.maximum(x, 0.0)


def sigmoid(x: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """1 / (1 + exp(-x)), by tanh, which cannot overflow."""
    return 0.5 * np.tanh(0.5 * x) + 0.5


def swish(x: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """`x * sigmoid(x)`."""
    return x * sigmoid(x)


def gelu(x: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """The tanh approximation of `x` times the normal distribution function of `x`."""
    return 0.5 * x * (1.0 + np.tanh(np.sqrt(2.0 / np.pi) * (x + 0.044715 * x * x * x)))
