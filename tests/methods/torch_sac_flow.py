"""One update of SAC-Flow, written again in float64 PyTorch from the equations: autograd, torch's Adam.

It shares nothing with the package but the order of the parameters: a tree of JAX arrays becomes the same
tree of torch tensors, and the noise comes in as numbers.
"""

from typing import NamedTuple

import jax
import numpy as np
import torch

EPSILON = 1e-3


class Learned(NamedTuple):
    """What one update computed; trees as those of the method's state, with NumPy arrays."""

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


def by_running(norm, moments, x):
    return (x - moments.mean) / torch.sqrt(moments.variance + EPSILON) * norm.scale + norm.bias


def by_batch(norm, x):
    centred = x - x.mean(0)
    return centred / torch.sqrt((centred**2).mean(0) + EPSILON) * norm.scale + norm.bias


def moved(moments, x):
    """Running mean and variance after one call on the batch `x`."""
    x = x.detach()
    mean, variance = x.mean(0), x.var(0, unbiased=False)
    return 0.99 * moments[0] + 0.01 * mean, 0.99 * moments[1] + 0.01 * variance


def time_features(field, time):
    frequencies = torch.tensor([10 ** (-4 * i / 15) for i in range(16)], dtype=torch.float64)
    waves = torch.cat([torch.sin(time * frequencies), torch.cos(time * frequencies)])
    return dense(field.time_outer, torch.nn.functional.silu(dense(field.time_inner, waves)))


def flow(actor, observations, noise, normalise):
    """tanh of the flow's end and the path's log-density; `normalise` gives the inputs of the velocity."""
    field, spread = actor.field, actor.deviation
    hidden = torch.relu(dense(spread.second, torch.relu(dense(spread.first, observations))))
    deviation = torch.exp(-5 + 3.5 * (torch.tanh(dense(spread.last, hidden)) + 1))
    start, steps = constants(noise.start), constants(noise.steps)
    sample = start
    log_prob = torch.distributions.Normal(0.0, 1.0).log_prob(start).sum(-1)
    for step, drawn in enumerate(steps):
        times = time_features(field, step / len(steps)).expand(len(start), -1)
        inputs = torch.cat([*normalise(observations, sample), times], dim=-1)
        of_gate, of_candidate = torch.nn.functional.silu(dense(field.inner, inputs)).chunk(2, dim=-1)
        velocity = torch.sigmoid(dense(field.gate, of_gate)) * (dense(field.candidate, of_candidate) - sample)
        mean = sample + velocity / len(steps)
        sample = mean + deviation * drawn
        log_prob = log_prob + torch.distributions.Normal(mean, deviation).log_prob(sample).sum(-1)
    squashed = torch.tanh(sample)
    return squashed, log_prob - torch.log(1 - squashed**2 + 1e-6).sum(-1)


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
    actor_running = constants(state.actor_moments)

    def acting(observations, sample):
        field = actor.field
        return (
            by_running(field.observation_norm, actor_running.observation, observations),
            by_running(field.sample_norm, actor_running.sample, sample),
        )

    next_actions, log_prob = flow(actor, data.next_observations, noise, acting)
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


def actor_update(config, state, batch, noise):
    """Loss, gradient and new parameters of the actor; in `extra` the entropy and the new statistics.

    `state` has the critic that the loss sees: the one after this update's critic step.
    """
    actor, critic = tensors(state.actor), constants(state.critic)
    observations = constants(batch.observations)
    statistics = tuple(constants(state.actor_moments.sample)[:2])
    observed = tuple(constants(state.actor_moments.observation)[:2])

    def learning(observations, sample):
        nonlocal statistics, observed
        statistics, observed = moved(statistics, sample), moved(observed, observations)
        field = actor.field
        return by_batch(field.observation_norm, observations), by_batch(field.sample_norm, sample)

    actions, log_prob = flow(actor, observations, noise, learning)
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
    loss = (float(np.exp(state.log_temperature)) * log_prob - torch.minimum(*values)).mean()
    entropy = -float(log_prob.detach().mean())
    gradient, parameters = adam(actor, loss, config.actor_learning_rate)
    extra = {"entropy": entropy, "statistics": {"observation": observed, "sample": statistics}}
    return Learned(float(loss.detach()), gradient, parameters, extra)
