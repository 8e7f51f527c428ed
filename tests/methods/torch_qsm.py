"""One update of QSM, written again in float64 PyTorch from the equations: autograd, torch's Adam.

It shares nothing with the package but the order of the parameters: a tree of JAX arrays becomes the same
tree of torch tensors, and the noise comes in as numbers.
"""

import math
from typing import NamedTuple

import jax
import numpy as np
import torch


class Learned(NamedTuple):
    """What one update computed: parameters and gradients leaf by leaf, as NumPy arrays."""

    loss: float
    gradient: list
    parameters: list
    extra: dict


def constants(tree):
    return jax.tree.map(lambda leaf: torch.tensor(np.array(leaf), dtype=torch.float64), tree)


def tensors(tree):
    return jax.tree.map(torch.Tensor.requires_grad_, constants(tree))


def dense(layer, x):
    return x @ layer.kernel + layer.bias


def critic(networks, index, observations, actions):
    x = torch.cat([observations, actions], dim=-1)
    first, second, last = ((layer.kernel[index], layer.bias[index]) for layer in networks.layers)
    for kernel, bias in (first, second):
        x = torch.relu(x @ kernel + bias)
    return (x @ last[0] + last[1])[:, 0]


def schedule(steps):
    """Alphas and their running products, step 1 first."""
    alphas = [math.exp(-0.1 / steps - 9.9 * (2 * t - 1) / (2 * steps**2)) for t in range(1, steps + 1)]
    return alphas, [math.prod(alphas[: t + 1]) for t in range(steps)]


def predicted(net, observations, actions, times):
    mish = torch.nn.functional.mish
    angles = 2 * math.pi * times[:, None] * net.clock.frequencies
    hidden, outer = net.clock.network.layers
    code = dense(outer, mish(dense(hidden, torch.cat([torch.cos(angles), torch.sin(angles)], dim=-1))))
    x = torch.cat([actions, observations, code], dim=-1)
    return dense(net.last, mish(dense(net.second, mish(dense(net.first, x)))))


def sampled(net, observations, noise):
    """The clipped reverse chain; `noise` is the start, then one draw per step but the last."""
    steps = len(noise)
    alphas, kept = schedule(steps)
    x = noise[0]
    for step in range(steps - 1, -1, -1):
        times = torch.full((len(x),), float(step), dtype=torch.float64)
        share = (1 - alphas[step]) / math.sqrt(1 - kept[step])
        x = (x - share * predicted(net, observations, x, times)) / math.sqrt(alphas[step])
        if step > 0:
            x = x + math.sqrt(1 - alphas[step]) * noise[steps - step]
        x = x.clamp(-1, 1)
    return x


def adam(parameters, loss, learning_rate):
    """The gradient of `loss`, and the parameters after Adam's first step."""
    leaves = jax.tree.leaves(parameters)
    gradient = torch.autograd.grad(loss, leaves)
    optimizer = torch.optim.Adam(leaves, lr=learning_rate)
    for leaf, slope in zip(leaves, gradient, strict=True):
        leaf.grad = slope
    slopes = [leaf.grad.numpy().copy() for leaf in leaves]
    optimizer.step()
    return slopes, [leaf.detach().numpy() for leaf in leaves]


def critic_update(config, state, batch, noise):
    """The published loss (a plain squared error per critic), its gradient and the critics after the step."""
    data, noise, actor = constants(batch), constants(noise), constants(state.actor)
    targets, networks = constants(state.critic.target), tensors(state.critic.networks)
    sample = sampled(actor, data.next_observations, noise[:-1])
    following = (sample + 0.1 * noise[-1]).clamp(-1, 1)
    bootstrap = torch.minimum(*(critic(targets, i, data.next_observations, following) for i in (0, 1)))
    wanted = data.rewards + config.discount * (1 - data.terminated) * bootstrap
    values = [critic(networks, i, data.observations, data.actions) for i in (0, 1)]
    loss = sum(torch.nn.functional.mse_loss(value, wanted) for value in values)
    extra = {
        "value": float(torch.stack(values).detach().mean()),
        "saturated": float((sample.abs() == 1).double().mean()),
    }
    return Learned(float(loss.detach()), *adam(networks, loss, config.critic_learning_rate), extra)


def actor_update(config, state, batch, times, noise):
    """Loss, gradient and new denoiser; `state` has the critics that the loss sees, those after their step."""
    data, noise, net = constants(batch), constants(noise), tensors(state.actor)
    networks = constants(state.critic.networks)
    kept = torch.tensor([schedule(config.diffusion_steps)[1][t] for t in np.asarray(times)])[:, None]
    noisy = (kept.sqrt() * data.actions + (1 - kept).sqrt() * noise).requires_grad_()
    both = [critic(networks, i, data.observations, noisy).sum() for i in (0, 1)]
    slopes = [torch.autograd.grad(each, noisy)[0] for each in both]
    scores = config.gradient_scale * (slopes[0] + slopes[1]) / 2
    found = predicted(net, data.observations, noisy.detach(), constants(times))
    loss = ((found + scores) ** 2).mean()
    extra = {
        "target_gradient_max": float(scores.abs().max()),
        "outside": float((noisy.abs() > 1).double().mean()),
    }
    return Learned(float(loss.detach()), *adam(net, loss, config.actor_learning_rate), extra)
