"""One update of SAC, written again in float64 PyTorch from the equations; gradients and Adam are torch's.

It shares nothing with the package but the order of the parameters. The CrossQ critic is the one written for
SAC-Flow's reference.
"""

from typing import NamedTuple

import jax
import numpy as np
import torch
from torch import distributions
from torch_sac_flow import by_batch, by_running, constants, one_critic, renorm_critic, tensors


class Learned(NamedTuple):
    """What one update computed; lists of NumPy arrays in the order of the state's leaves."""

    loss: float
    gradient: list
    parameters: list
    mean: float
    """Of the critics' values, or of the actions' surprise: the entropy."""


def stack(network, x):
    *hidden, last = network.layers
    for layer in hidden:
        x = torch.relu(x @ layer.kernel + layer.bias)
    return x @ last.kernel + last.bias


def policy(actor, observations, noise):
    """Sampled actions and their log-density."""
    mean, raw = stack(actor.network, observations).chunk(2, dim=-1)
    deviation = torch.exp(3.5 * torch.tanh(raw) - 1.5)
    before = mean + deviation * constants(noise)
    slope = 1 - torch.tanh(before) ** 2 + 1e-6
    log_prob = distributions.Normal(mean, deviation).log_prob(before) - torch.log(slope)
    return torch.tanh(before), log_prob.sum(-1)


def adam(config, learning_rate, parameters, loss):
    """The gradient of `loss`, and the parameters after Adam's first step."""
    leaves = jax.tree.leaves(parameters)
    gradient = torch.autograd.grad(loss, leaves)
    optimizer = torch.optim.Adam(leaves, lr=learning_rate, betas=(config.momentum, 0.999))
    for leaf, slope in zip(leaves, gradient, strict=True):
        leaf.grad = slope
    optimizer.step()
    return [slope.numpy() for slope in gradient], [leaf.detach().numpy() for leaf in leaves]


def both_halves(networks, now, then):
    """CrossQ's joint pass in training: values of this and of the next step, critic by critic."""
    rows = torch.cat([now, then])
    members = [one_critic(networks, index) for index in (0, 1)]
    every = [renorm_critic(each, rows, lambda _, norm, x: by_batch(norm, x)) for each in members]
    return [each[: len(now)] for each in every], [each[len(now) :] for each in every]


def plain(networks, x):
    return [stack(one_critic(networks, index), x)[:, 0] for index in (0, 1)]


def inferred(networks, moments, x):
    """CrossQ's values under the running statistics."""
    values = []
    for index in (0, 1):

        def normalise(place, norm, x, index=index):
            return by_running(norm, one_critic(moments[place], index), x)

        values.append(renorm_critic(one_critic(networks, index), x, normalise))
    return values


def critic_update(config, state, batch, noise):
    """Of the critics; the target's next actions come from `noise`."""
    data, networks = constants(batch), tensors(state.critic.networks)
    next_actions, log_prob = policy(constants(state.actor), data.next_observations, noise)
    now = torch.cat([data.observations, data.actions], dim=-1)
    then = torch.cat([data.next_observations, next_actions], dim=-1)
    if config.critic == "crossq":
        values, next_values = both_halves(networks, now, then)
    else:
        values, next_values = plain(networks, now), plain(constants(state.critic.target), then)
    soft = torch.minimum(*next_values) - float(np.exp(state.log_temperature)) * log_prob
    target = (data.rewards + config.discount * (1 - data.terminated) * soft).detach()
    loss = sum(0.5 * ((each - target) ** 2).mean() for each in values)
    mean = float(torch.stack(values).detach().mean())
    return Learned(float(loss.detach()), *adam(config, config.critic_learning_rate, networks, loss), mean)


def actor_update(config, state, batch, noise):
    """Of the actor; `state` has the critic that the loss sees, the one after this update's critic step."""
    actor, critic, observations = tensors(state.actor), constants(state.critic), constants(batch.observations)
    actions, log_prob = policy(actor, observations, noise)
    x = torch.cat([observations, actions], dim=-1)
    crossq = config.critic == "crossq"
    values = inferred(critic.networks, critic.moments, x) if crossq else plain(critic.networks, x)
    loss = (float(np.exp(state.log_temperature)) * log_prob - torch.minimum(*values)).mean()
    entropy = -float(log_prob.detach().mean())
    return Learned(float(loss.detach()), *adam(config, config.actor_learning_rate, actor, loss), entropy)
