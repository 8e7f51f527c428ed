"""Flow matching where a flow actor integrates: before tanh, at its own steps, under its own noise.

An action is where a path ends, put through tanh; so a path has to end at the action's inverse tanh, not at
the action. A step adds noise to the sample; so the velocity that is learned leads from where the sample is,
noise included, straight to the end in the time that is left.
"""

from typing import Any, NamedTuple

import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PyTree

from hcpg.networks.batch_renorm import BatchRenorm
from hcpg.networks.flow import FlowActor, Noise, Normalise, at_rest

MARGIN = 0.02
"""Actions are moved this far inside their bounds, where the inverse of tanh is finite: at most 2.3."""
DEVIATION = 0.1
"""What the noise of every step is taught to be, before tanh: no demonstration determines it."""


class Bridge(NamedTuple):
    """Paths of the actor's own steps that end at given actions."""

    samples: Float[Array, "M B A"]
    """Where each step begins."""
    velocities: Float[Array, "M B A"]
    """What leads from there straight to the end."""


def end_points(actions: Float[Array, "*batch A"]) -> Float[Array, "*batch A"]:
    """Where paths have to end for tanh to give `actions`; those on the bounds are moved inside."""
    return jnp.arctanh(jnp.clip(actions, -1.0 + MARGIN, 1.0 - MARGIN))


def bridge(ends: Float[Array, "B A"], noise: Noise, deviation: float) -> Bridge:
    """Paths to `ends`; their last sample is the end point plus the last step's noise.

    Without step noise every velocity of a path is end minus start, as in flow matching on straight lines.
    """
    steps = len(noise.steps)
    sample, samples, velocities = noise.start, [], []
    for step in range(steps):
        velocity = (ends - sample) * steps / (steps - step)
        samples.append(sample)
        velocities.append(velocity)
        sample = sample + velocity / steps + deviation * noise.steps[step]
    return Bridge(jnp.stack(samples), jnp.stack(velocities))


def matching_loss(
    actor: FlowActor,
    moments: PyTree,
    observations: Float[Array, "B O"],
    path: Bridge,
    deviation: float,
) -> tuple[Float[Array, ""], tuple[PyTree, dict[str, Array]]]:
    """The loss in both of the actor's modes, the moments after this batch, and what the loss consists of.

    An actor learns under the statistics of its batch and acts under running ones. Cloned in one mode alone it
    would do something else in the other.
    """
    learning, moments = _errors(actor, moments, observations, path, deviation, BatchRenorm.train)
    settled = jax.lax.stop_gradient(moments)
    acting, _ = _errors(actor, settled, observations, path, deviation, at_rest)
    loss = learning.sum() + acting.sum()
    metrics = {
        "matching_loss": acting[0],
        "matching_loss_in_learning": learning[0],
        "deviation_loss": acting[1],
    }
    return loss, (moments, metrics)


def _errors(
    actor: FlowActor,
    moments: Any,
    observations: Float[Array, "B O"],
    path: Bridge,
    deviation: float,
    normalise: Normalise,
) -> tuple[Float[Array, "2"], Any]:
    """Mean squared errors of velocity and log-deviation over all steps, and the moments after them."""
    steps = len(path.samples)
    drive, moments = actor.begin(moments, observations, steps, normalise)
    errors = []
    for step in range(steps):
        push, moments = actor.push(drive, step, path.samples[step], moments, normalise)
        of_velocity = jnp.square(push.velocity - path.velocities[step]).mean()
        of_deviation = jnp.square(push.log_deviation - jnp.log(deviation)).mean()
        errors.append(jnp.stack([of_velocity, of_deviation]))
    return jnp.stack(errors).mean(axis=0), moments
