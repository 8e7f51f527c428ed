"""How a simulation is reset and stepped: the seam between the suite and what does the arithmetic."""

import warnings
from typing import Any, Protocol, runtime_checkable

import numpy as np

from hcpg.types import Float


@runtime_checkable
class Stepping(Protocol):
    """One simulation, in NumPy; it knows neither start states nor time limits."""

    simulation: Any
    """ManiSkill's environment, whose scene holds the state."""

    def reset(self, seed: int) -> Float[np.ndarray, " O"]:
        """The first observation of the episode that ManiSkill's `seed`, in [0, 2**32), names."""
        ...

    def step(self, action: Float[np.ndarray, " A"]) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, reward and whether the task's condition holds, after one action."""
        ...

    def close(self) -> None:
        """Free the simulation; safe to call twice."""
        ...


class TorchStepping:
    """ManiSkill's own arithmetic, in PyTorch on batches of one."""

    def __init__(self, simulation: Any) -> None:
        self.simulation = simulation

    def reset(self, seed: int) -> Float[np.ndarray, " O"]:
        """The first observation; PyTorch's global generator is neither asked nor moved."""
        observation, _ = self.simulation.reset(seed=seed)
        return _row(observation)

    def step(self, action: Float[np.ndarray, " A"]) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, normalised dense reward and success."""
        with warnings.catch_warnings():
            # ManiSkill asks NumPy whether a tensor is finite, in a way that NumPy 2 warns of.
            warnings.filterwarnings("ignore", "__array_wrap__", DeprecationWarning)
            observation, reward, _, _, info = self.simulation.step(action)
        return _row(observation), float(reward[0]), bool(info["success"][0])

    def close(self) -> None:
        """Free the simulation; safe to call twice."""
        self.simulation.close()


def _row(batch: Any) -> Float[np.ndarray, " O"]:
    return batch[0].numpy().astype(np.float32, copy=True)
