"""What maximum-entropy actor-critics do alike: improve the critics, ask them, steer the temperature."""

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float, PyTree

from hcpg.networks.critics import Critics, CriticState, Target
from hcpg.networks.descent import descend
from hcpg.types import Batch


def soft_target(
    actions: Float[Array, "B A"],
    log_prob: Float[Array, " B"],
    log_temperature: Float[Array, ""],
    discount: float,
) -> Target:
    """What the next state's actions add to the Bellman target: their value and their entropy.

    `log_prob` is theirs or, of a flow, their path's; nats.
    """
    return Target(actions, -jnp.exp(log_temperature) * log_prob, discount)


def improve_critics(
    recipe: Critics,
    state: CriticState,
    batch: Batch,
    following: Target,
    optimizer: optax.GradientTransformation,
    optimizer_state: PyTree,
) -> tuple[CriticState, PyTree, dict[str, Array]]:
    """The critics after a step on their loss and one of their targets; the optimizer's state; metrics."""
    (loss, (state, values)), gradient = jax.value_and_grad(recipe.loss, has_aux=True)(
        state.networks, state, batch, following
    )
    networks, optimizer_state = descend(optimizer, gradient, optimizer_state, state.networks)
    state = recipe.follow(state._replace(networks=networks))
    return state, optimizer_state, {"critic_loss": loss, "value": values.mean()}


def pessimistic_values(
    recipe: Critics, state: CriticState, observations: Float[Array, "*B O"], actions: Float[Array, "K A"]
) -> Float[Array, " K"]:
    """The smallest critic's value of each action, at its own observation or at the one given for all."""
    repeated = jnp.broadcast_to(observations, (actions.shape[0], observations.shape[-1]))
    return recipe.values(state, jnp.concatenate([repeated, actions], axis=-1)).min(axis=0)


def improve_temperature(
    log_temperature: Float[Array, ""],
    surplus: Float[Array, ""],
    optimizer: optax.GradientTransformation,
    optimizer_state: PyTree,
) -> tuple[Float[Array, ""], PyTree]:
    """The log-temperature after one step, and the optimizer's state: it falls while there is a surplus.

    `surplus` is the policy's entropy less its target, nats; the loss is temperature * surplus.
    """
    slope = jnp.exp(log_temperature) * surplus
    return descend(optimizer, slope, optimizer_state, log_temperature)
