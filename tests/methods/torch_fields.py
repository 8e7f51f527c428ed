"""The three flow actors written again in float64 PyTorch from the equations, step by step, nothing fused.

A tree of JAX arrays becomes the same tree of torch tensors, and the noise comes in as numbers.
"""

from functools import reduce

import jax
import numpy as np
import torch
from torch.nn.functional import gelu, silu

EPSILON = 1e-3


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


def at(tree, place):
    """The part of a tree of moments that a place names, such as ("layers", 0, 2)."""
    return reduce(lambda node, key: getattr(node, key) if isinstance(key, str) else node[key], place, tree)


class Norms:
    """Normalises by the batch while learning, by the running moments otherwise; `seen` has the moved ones."""

    def __init__(self, moments, learning):
        self.moments, self.learning, self.seen = constants(moments), learning, {}

    def __call__(self, norm, place, x):
        running = at(self.moments, place)
        if not self.learning:
            return by_running(norm, running, x)
        self.seen[place] = moved(self.seen.get(place, running[:2]), x)
        return by_batch(norm, x)


def bounded(raw):
    return torch.exp(-5 + 3.5 * (torch.tanh(raw) + 1))


def time_features(field, time):
    frequencies = torch.tensor([10 ** (-4 * i / 15) for i in range(16)], dtype=torch.float64)
    waves = torch.cat([torch.sin(time * frequencies), torch.cos(time * frequencies)])
    return dense(field.time_outer, silu(dense(field.time_inner, waves)))


def gated(actor, norms, observations, sample, clock):
    """Velocity, and the deviation of the noise on the sample, at step clock[0] of clock[1]."""
    field, spread = actor.field, actor.deviation
    hidden = torch.relu(dense(spread.second, torch.relu(dense(spread.first, observations))))
    normalised = [
        norms(field.observation_norm, ("observation",), observations),
        norms(field.sample_norm, ("sample",), sample),
        time_features(field, clock[0] / clock[1]).expand(len(sample), -1),
    ]
    of_gate, of_candidate = silu(dense(field.inner, torch.cat(normalised, dim=-1))).chunk(2, dim=-1)
    gate = torch.sigmoid(dense(field.gate, of_gate))
    return gate * (dense(field.candidate, of_candidate) - sample), bounded(dense(spread.last, hidden))


def plain(actor, norms, observations, sample, clock):
    times = torch.full((len(sample), 1), clock[0] / clock[1], dtype=torch.float64)
    place = clock[0] if len(actor.norms) > 1 else 0
    inputs = norms(actor.norms[place], ("inputs", place), torch.cat([observations, sample, times], dim=-1))
    hidden = torch.relu(dense(actor.second, torch.relu(dense(actor.first, inputs))))
    return dense(actor.velocity, hidden), bounded(dense(actor.deviation, hidden))


def embed(network, x):
    *hidden, last = network.layers
    for layer in hidden:
        x = silu(dense(layer, x))
    return dense(last, x)


def attended(attention, query, key_and_value):
    """Scaled dot products of four heads, with queries and keys of its own: over one key they are idle."""
    value = dense(attention.value, key_and_value)
    projections = torch.randn(2, value.shape[-1], value.shape[-1], dtype=torch.float64)
    heads = [
        part.reshape(len(part), 1, 4, -1).transpose(1, 2)
        for part in (query @ projections[0], key_and_value @ projections[1], value)
    ]
    read = torch.nn.functional.scaled_dot_product_attention(*heads).transpose(1, 2)
    return dense(attention.output, read.reshape(value.shape))


def decoder(actor, norms, observations, sample, clock):
    step, steps = clock
    seen = norms.seen.get(("observation",))  # one observation norm call per flow, not one per step
    memory = embed(actor.of_observation, norms(actor.observation_norm, ("observation",), observations))
    if seen is not None:
        norms.seen[("observation",)] = seen
    time = embed(actor.of_time, torch.full((len(sample), 1), step / steps, dtype=torch.float64))
    token = dense(actor.of_sample, norms(actor.sample_norms[step], ("samples", step), sample)) + time
    for index, layer in enumerate(actor.layers):

        def norm(number, x, layer=layer, index=index):
            return norms(layer.norms[number], ("layers", index, number), x)

        token = norm(0, token + attended(layer.to_itself, token, token))
        token = norm(1, token + attended(layer.to_observation, token, memory))
        fed = dense(layer.narrow, gelu(dense(layer.widen, token), approximate="tanh"))
        token = norm(2, token + fed)
    return dense(actor.velocity, token), bounded(dense(actor.deviation, token)) / steps


FIELDS = {"gated": gated, "plain": plain, "decoder": decoder}


def path(actor, velocity, norms, observations, noise, nudges=(0.0, 0.0)):
    """The samples x_0 ... x_M, each step's mean, and each step's deviation; nudges move x_0 and x_M."""
    steps = constants(noise.steps)
    samples, means, deviations = [constants(noise.start) + nudges[0]], [], []
    for step, drawn in enumerate(steps):
        field = FIELDS[velocity]
        slope, deviation = field(actor, norms, observations, samples[-1], (step, len(steps)))
        means.append(samples[-1] + slope / len(steps))
        samples.append(means[-1] + deviation * drawn)
        deviations.append(deviation)
    samples[-1] = samples[-1] + nudges[1]
    return samples, means, deviations


def flow(actor, config, norms, observations, noise, nudges=(0.0, 0.0)):
    """tanh of the flow's end and the path's log-density, as `config` has it; nudges move its ends alone."""
    normal = torch.distributions.Normal
    samples, means, deviations = path(actor, config.velocity, norms, observations, noise, nudges)
    drawn = [samples[0] - nudges[0], *samples[1:-1], samples[-1] - nudges[1]]
    log_prob = normal(0.0, 1.0).log_prob(drawn[0]).sum(-1)
    for sample, mean, deviation in zip(drawn[1:], means, deviations, strict=True):
        if config.density == "as_published":
            log_prob = log_prob + normal(0.0, 1.0).log_prob((sample - mean) / deviation).sum(-1)
        else:
            log_prob = log_prob + normal(mean, deviation).log_prob(sample).sum(-1)
    squashed = torch.tanh(samples[-1])
    return squashed, log_prob - torch.log(1 - squashed**2 + 1e-6).sum(-1)
