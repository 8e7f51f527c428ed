"""A flow actor: noise carried to an action by Euler steps with learned noise on the way."""

import functools
import operator
from abc import abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from hcpg.networks.batch_renorm import BatchRenorm, Moments
from hcpg.networks.gaussian import LOG_SQRT_TWO_PI, tanh_log_slope

Normalise = Callable[..., tuple[Array, Moments]]
"""(norm, moments, x, calls = 1) -> y and the moments after it: `BatchRenorm.train` or `at_rest`."""


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


class Push(NamedTuple):
    """What moves the sample in one step."""

    velocity: Float[Array, "*batch A"]
    log_deviation: Float[Array, "*state A"]
    """Of the noise added to the sample itself, whatever space a field draws it in."""
    counted: Float[Array, "*state A"]
    """`log_deviation` as the path's density counts it; they differ in a published defect alone."""


class FlowActor(eqx.Module):
    """A chain of Gaussian steps from noise to an action; a subclass says what moves the sample.

    Source: paper, equations (1) and (2). Deviation: as in SAC-Flow's code each step adds noise
    `deviation * normal` (no square root of the step size), and tanh bounds the action.
    """

    @abstractmethod
    def moments(self) -> PyTree:
        """Fresh running statistics of all its normalising layers."""

    @abstractmethod
    def begin(
        self, moments: Any, observations: Float[Array, "*state O"], flow_steps: int, normalise: Normalise
    ) -> tuple[Any, Any]:
        """What the steps share, computed once per flow (the drive), and the moments after it."""

    @abstractmethod
    def push(
        self, drive: Any, step: int, sample: Float[Array, "*batch A"], moments: Any, normalise: Normalise
    ) -> tuple[Push, Any]:
        """What moves `sample` in step number `step`, and the moments after it."""

    def cloning_part(self, gradient: PyTree) -> PyTree:
        """What cloning follows of a gradient: all of it, where no part keeps the others from learning."""
        return gradient

    def infer(self, moments: PyTree, observations: Float[Array, "*state O"], noise: Noise) -> Path:
        """Paths under the running statistics; `noise` may have more leading axes than needed."""
        return self._run(moments, observations, noise, at_rest, _no_nudges(noise))[0]

    def train(
        self,
        moments: PyTree,
        observations: Float[Array, "B O"],
        noise: Noise,
        nudges: Float[Array, "M1 *batch A"] | None = None,
    ) -> tuple[Path, PyTree]:
        """Paths under the batch's statistics, and the running statistics after them.

        `nudges` are added to x_0 ... x_M: the gradient of a loss by zero nudges is that by the samples.
        """
        nudges = _no_nudges(noise) if nudges is None else nudges
        return self._run(moments, observations, noise, BatchRenorm.train, nudges)

    def _run(
        self,
        moments: PyTree,
        observations: Float[Array, "*state O"],
        noise: Noise,
        normalise: Normalise,
        nudges: Float[Array, "M1 *batch A"],
    ) -> tuple[Path, PyTree]:
        flow_steps = len(noise.steps)
        drive, moments = self.begin(moments, observations, flow_steps, normalise)
        sample, counted = noise.start + nudges[0], []
        for step in range(flow_steps):
            push, moments = self.push(drive, step, sample, moments, normalise)
            spread = jnp.exp(push.log_deviation) * noise.steps[step]
            sample = sample + push.velocity / flow_steps + spread + nudges[step + 1]
            counted.append(push.counted)
        total = functools.reduce(operator.add, counted)
        return Path(jnp.tanh(sample), path_log_prob(noise, total, sample)), moments


def _no_nudges(noise: Noise) -> Float[Array, "M1 *batch A"]:
    return jnp.zeros((len(noise.steps) + 1, *noise.start.shape))


def at_rest(
    norm: BatchRenorm, moments: Moments, x: Float[Array, "*batch F"], calls: int = 1
) -> tuple[Float[Array, "*batch F"], Moments]:
    """`x` normalised by the running moments, which stay as they are however many `calls` it stands for."""
    return norm.infer(moments, x), moments


def step_times(flow_steps: int) -> Float[Array, " M"]:
    """The time at which each step begins, in [0, 1)."""
    return jnp.arange(flow_steps) / flow_steps


def path_log_prob(
    noise: Noise, log_deviations: Float[Array, "*state A"], end: Float[Array, "*batch A"]
) -> Float[Array, "*batch"]:
    """Log-density of start and steps, less the log-determinant of tanh.

    `log_deviations` is their sum over the steps. A step's residual over its deviation is the drawn noise
    itself, so the density needs no residuals, and entropy reaches the parameters through the deviation and
    the tanh only.

    Source: SAC-Flow's path density, used by the paper as the original objective (section III-A).
    """
    flow_steps = noise.steps.shape[0]
    squares = jnp.square(noise.start) + jnp.square(noise.steps).sum(axis=0)
    gaussian = -0.5 * squares - log_deviations - (flow_steps + 1) * LOG_SQRT_TWO_PI
    return (gaussian - tanh_log_slope(end)).sum(axis=-1)
