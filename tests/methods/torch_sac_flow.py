"""One update of SAC-Flow, written again in float64 PyTorch from the equations: autograd, torch's Adam.

It shares nothing with the package but the order of the parameters; the actors are in torch_fields.py.
"""

from typing import NamedTuple

import jax
import numpy as np
import torch
from torch_fields import EPSILON, Norms, by_batch, by_running, constants, dense, flow, moved, tensors


class Learned(NamedTuple):
    """What one update computed; trees as those of the method's state, with NumPy arrays."""

    loss: float
    gradient: list
    parameters: list
    extra: dict


def one_critic(networks, index):
    return jax.tree.map(lambda leaf: leaf[index], networks)


def renorm_critic(network, x, normalise):
    for place in (0, 1):
        x = torch.relu(dense(network.layers[place], normalise(place, network.norms[place], x)))
    return dense(network.layers[2], normalise(2, network.norms[2], x))[:, 0]


def layer_critic(network, moments, x):
    x = (x - moments[0]) / torch.sqrt(moments[1] + EPSILON)
    for layer in network.layers[:2]:
        x = dense(layer, x)
        x = torch.relu(torch.nn.functional.layer_norm(x, x.shape[-1:], eps=1e-5))
    return dense(network.layers[2], x)[:, 0]


def adam(parameters, loss, learning_rate):
    """The gradient of `loss`, and the parameters after Adam's first step with beta 1 of one half."""
    leaves = jax.tree.leaves(parameters)
    gradient = torch.autograd.grad(loss, leaves, allow_unused=True)
    optimizer = torch.optim.Adam(leaves, lr=learning_rate, betas=(0.5, 0.999))
    for leaf, slope in zip(leaves, gradient, strict=True):
        leaf.grad = torch.zeros_like(leaf) if slope is None else slope
    slopes = [leaf.grad.numpy().copy() for leaf in leaves]
    optimizer.step()
    return slopes, [leaf.detach().numpy() for leaf in leaves]


def critic_update(config, state, batch, noise):
    """Loss, gradient and new parameters of the critics; in `extra` the value and the new statistics."""
    actor, critic = constants(state.actor), state.critic
    networks, running = tensors(critic.networks), constants(critic.moments)
    data = constants(batch)
    acting = Norms(state.actor_moments, learning=False)
    next_actions, log_prob = flow(actor, config, acting, data.next_observations, noise)
    now = torch.cat([data.observations, data.actions], dim=-1)
    then = torch.cat([data.next_observations, next_actions], dim=-1)
    values, next_values, statistics = [], [], []
    if config.critic == "polyak":
        statistics = moved(running, now)
        values = [layer_critic(one_critic(networks, index), statistics, now) for index in (0, 1)]
        target = constants(critic.target)
        next_values = [layer_critic(one_critic(target, index), statistics, then) for index in (0, 1)]
    for index in (0, 1) if config.critic == "crossq" else ():
        network = one_critic(networks, index)
        seen = []

        def normalise(place, norm, x, seen=seen, index=index):
            moments = running[place]
            seen.append(moved((moments.mean[index], moments.variance[index]), x))
            return by_batch(norm, x)

        both = renorm_critic(network, torch.cat([now, then]), normalise)
        values.append(both[: len(now)])
        next_values.append(both[len(now) :])
        statistics.append(seen)
    temperature = float(np.exp(state.log_temperature))
    soft = torch.minimum(*next_values) - temperature * log_prob
    target = (data.rewards + config.discount * (1 - data.terminated) * soft).detach()
    loss = sum(0.5 * ((value - target) ** 2).mean() for value in values)
    mean_value = float(torch.stack(values).detach().mean())
    gradient, parameters = adam(networks, loss, config.critic_learning_rate)
    return Learned(
        float(loss.detach()), gradient, parameters, {"value": mean_value, "statistics": statistics}
    )


def actor_loss(config, state, observations, actions, log_prob):
    critic = constants(state.critic)
    inputs = torch.cat([observations, actions], dim=-1)
    values = []
    for index in (0, 1):
        network = one_critic(critic.networks, index)
        if config.critic == "polyak":
            values.append(layer_critic(network, critic.moments, inputs))
            continue

        def normalise(place, norm, x, index=index):
            return by_running(norm, one_critic(critic.moments[place], index), x)

        values.append(renorm_critic(network, inputs, normalise))
    return (float(np.exp(state.log_temperature)) * log_prob - torch.minimum(*values)).mean()


def slopes_by_ends(config, state, batch, noise):
    """The gradients of the actor's loss by x_0 and by x_M, the noise that led there held."""
    observations, norms = constants(batch.observations), Norms(state.actor_moments, learning=True)
    nudges = torch.zeros((2, *noise.start.shape), dtype=torch.float64, requires_grad=True)
    actions, log_prob = flow(constants(state.actor), config, norms, observations, noise, nudges)
    actor_loss(config, state, observations, actions, log_prob).backward()
    return nudges.grad.numpy()


def actor_update(config, state, batch, noise):
    """Loss, gradient and new parameters of the actor; in `extra` the entropy and the new statistics.

    `state` has the critic that the loss sees: the one after this update's critic step.
    """
    actor, observations = tensors(state.actor), constants(batch.observations)
    learning = Norms(state.actor_moments, learning=True)
    actions, log_prob = flow(actor, config, learning, observations, noise)
    loss = actor_loss(config, state, observations, actions, log_prob)
    entropy = -float(log_prob.detach().mean())
    gradient, parameters = adam(actor, loss, config.actor_learning_rate)
    extra = {"entropy": entropy, "statistics": learning.seen}
    return Learned(float(loss.detach()), gradient, parameters, extra)
