"""One update of FlowRL, written again in float64 PyTorch from the equations: autograd, torch's Adam.

It shares nothing with the package but the order of the parameters: a tree of JAX arrays becomes the same
tree of torch tensors, and the noise comes in as numbers.
"""

from typing import NamedTuple

import jax
import numpy as np
import torch
from torch.nn import functional


class Learned(NamedTuple):
    """What one gradient step computed; gradients and parameters in the order of the state's leaves."""

    loss: float
    gradient: list
    parameters: list


def constants(tree):
    return jax.tree.map(lambda leaf: torch.tensor(np.array(leaf), dtype=torch.float64), tree)


def tensors(tree):
    return jax.tree.map(torch.Tensor.requires_grad_, constants(tree))


def stack(network, x, activations):
    for layer, norm, activation in zip(network.layers[:-1], network.norms, activations, strict=True):
        x = x @ layer.kernel + layer.bias
        x = activation(functional.layer_norm(x, x.shape[-1:], norm.gain, norm.bias, eps=1e-5))
    return x @ network.layers[-1].kernel + network.layers[-1].bias


def tower(network, x):
    return stack(network, x, [torch.nn.Identity(), functional.gelu, functional.gelu, torch.nn.Identity()])[
        :, 0
    ]


def twins(networks, observations, actions):
    members = [jax.tree.map(lambda leaf, at=at: leaf[at], networks) for at in (0, 1)]
    return [tower(member, torch.cat([observations, actions], dim=-1)) for member in members]


def velocity(actor, observations, sample, time):
    inputs = torch.cat([observations, sample, time], dim=-1)
    return stack(actor.field, inputs, [functional.elu, functional.elu])


def policy(actor, observations, start):
    """tanh of two midpoint steps, written out."""
    x = start
    for time in (0.0, 0.5):
        now, later = (torch.full((len(x), 1), t, dtype=x.dtype) for t in (time, time + 0.25))
        middle = x + 0.25 * velocity(actor, observations, x, now)
        x = x + 0.5 * velocity(actor, observations, middle, later)
    return torch.tanh(x)


def learned(parameters, loss, learning_rate):
    """The gradient of `loss`, and the parameters after Adam's first step."""
    leaves = jax.tree.leaves(parameters)
    optimizer = torch.optim.Adam(leaves, lr=learning_rate)
    loss.backward()
    slopes = [leaf.grad.numpy().copy() for leaf in leaves]
    optimizer.step()
    return Learned(float(loss.detach()), slopes, [leaf.detach().numpy() for leaf in leaves])


def regressed(config, networks, batch, following):
    """Both critics' step towards the reward and the discounted value of what follows."""
    online, data = tensors(networks), constants(batch)
    target = data.rewards + config.discount * (1 - data.terminated) * following
    values = twins(online, data.observations, data.actions)
    loss = sum(functional.mse_loss(value, target) for value in values)
    return learned(online, loss, config.learning_rate)


def critic_update(config, state, batch, start):
    data = constants(batch)
    actions = policy(constants(state.actor), data.next_observations, torch.tensor(start).double())
    following = torch.minimum(*twins(constants(state.critic.target), data.next_observations, actions))
    return regressed(config, state.critic.online, batch, following)


def buffer_critic_update(config, state, batch):
    following = tower(constants(state.buffer_value), constants(batch).next_observations)
    return regressed(config, state.buffer_critic.online, batch, following)


def buffer_value_update(config, state, batch):
    value, data = tensors(state.buffer_value), constants(batch)
    judged = torch.minimum(*twins(constants(state.buffer_critic.target), data.observations, data.actions))
    errors = judged - tower(value, data.observations)
    above, below = functional.relu(errors), functional.relu(-errors)
    loss = (config.expectile * above**2 + (1 - config.expectile) * below**2).mean()
    return learned(value, loss, config.learning_rate)


def actor_update(config, state, buffer_critic, batch, draws):
    """The policy's step; `state` has the policy critic after its step, `buffer_critic` is from before."""
    actor, data = tensors(state.actor), constants(batch)
    start, anchor_start, times = (torch.tensor(np.array(each)).double() for each in draws)
    own = torch.minimum(
        *twins(constants(state.critic.online), data.observations, policy(actor, data.observations, start))
    )
    replayed = torch.minimum(*twins(constants(buffer_critic), data.observations, data.actions))
    advantage = functional.relu(replayed - own.detach())
    weight = (config.anchor_weight * torch.exp(advantage - advantage.mean())).clamp(1e-3, 1)
    times = times[:, None]
    line = times * data.actions + (1 - times) * anchor_start
    misses = velocity(actor, data.observations, line, times) - (data.actions - anchor_start)
    if config.weighting == "as_published":
        anchor = (weight * (misses**2).mean()).mean()
    else:
        anchor = (weight[:, None] * misses**2).mean()
    return learned(actor, -own.mean() + anchor, config.learning_rate), float(weight.mean())
