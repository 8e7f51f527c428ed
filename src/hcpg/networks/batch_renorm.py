"""Batch renormalisation: batch statistics while learning, running ones while acting."""

from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int

MOMENTUM = 0.99
EPSILON = 1e-3
MAX_RATIO = 3.0
MAX_SHIFT = 5.0
WARMUP_CALLS = 100_000


class Moments(NamedTuple):
    """Running statistics of one layer; they change by observing data, not by gradients."""

    mean: Float[Array, "*stack F"]
    variance: Float[Array, "*stack F"]
    calls: Int[Array, "*stack"]
    """Training calls seen: the correction starts at `WARMUP_CALLS`."""

    @classmethod
    def create(cls, features: int) -> "Moments":
        """Zero mean, unit variance, no call yet."""
        return cls(jnp.zeros(features), jnp.ones(features), jnp.zeros((), jnp.int32))


def standardise(moments: Moments, x: Float[Array, "*batch F"]) -> Float[Array, "*batch F"]:
    """`x` by the running moments alone: nothing learned, nothing shared between rows."""
    return (x - moments.mean) * jax.lax.rsqrt(moments.variance + EPSILON)


def observe(moments: Moments, x: Float[Array, "B F"]) -> Moments:
    """The running moments after one more batch."""
    mean = x.mean(axis=0)
    return _observe(moments, mean, jnp.square(x - mean).mean(axis=0), 1)


class BatchRenorm(eqx.Module):
    """The learned scale and bias of one batch-renormalisation layer.

    Source: the CrossQ recipe (Bhatt et al. 2024) on Ioffe's batch renormalisation (2017). The epsilon
    is inside both square roots, hence not divided by the ratio: a deviation of its order.
    """

    scale: Float[Array, "*stack F"]
    bias: Float[Array, "*stack F"]

    @classmethod
    def create(cls, features: int) -> "BatchRenorm":
        """The identity after normalisation."""
        return cls(jnp.ones(features), jnp.zeros(features))

    def infer(self, moments: Moments, x: Float[Array, "*batch F"]) -> Float[Array, "*batch F"]:
        """Normalised by the running moments: a row does not depend on its neighbours."""
        gain = self.scale * jax.lax.rsqrt(moments.variance + EPSILON)
        return x * gain + (self.bias - moments.mean * gain)

    def train(
        self, moments: Moments, x: Float[Array, "B F"], calls: int = 1
    ) -> tuple[Float[Array, "B F"], Moments]:
        """Normalised by the batch's moments, and the running moments after `calls` such calls.

        `calls` > 1 stands for the flow's steps, which all see the same observation: its moments move
        as if seen `calls` times, while the correction is that of the first call.
        """
        mean = x.mean(axis=0)
        variance = jnp.square(x - mean).mean(axis=0)
        ratio, shift = _correction(moments, mean, variance)
        gain = self.scale * ratio * jax.lax.rsqrt(variance + EPSILON)
        y = x * gain + (self.bias + self.scale * shift - mean * gain)
        return y, _observe(moments, mean, variance, calls)


def _correction(
    moments: Moments, mean: Float[Array, " F"], variance: Float[Array, " F"]
) -> tuple[Float[Array, " F"], Float[Array, " F"]]:
    """Ratio and shift towards the running moments; no gradient flows through them."""
    running = jnp.sqrt(moments.variance + EPSILON)
    ratio = jnp.clip(jnp.sqrt(variance + EPSILON) / running, 1 / MAX_RATIO, MAX_RATIO)
    shift = jnp.clip((mean - moments.mean) / running, -MAX_SHIFT, MAX_SHIFT)
    warm = moments.calls >= WARMUP_CALLS
    corrected = jnp.where(warm, ratio, 1.0), jnp.where(warm, shift, 0.0)
    return jax.lax.stop_gradient(corrected)


def _observe(moments: Moments, mean: Float[Array, " F"], variance: Float[Array, " F"], calls: int) -> Moments:
    keep = MOMENTUM**calls
    mean, variance = jax.lax.stop_gradient((mean, variance))
    return Moments(
        keep * moments.mean + (1 - keep) * mean,
        keep * moments.variance + (1 - keep) * variance,
        moments.calls + calls,
    )
