"""The flow actor written again in float64 NumPy, with nothing shared or fused, for the tests to compare."""

import numpy as np


def dense(layer, x):
    return x @ np.asarray(layer.kernel, np.float64) + np.asarray(layer.bias, np.float64)


def swish(x):
    return x / (1 + np.exp(-x))


def renorm(norm, moments, x):
    scale, bias, mean, variance = (
        np.asarray(each, np.float64) for each in (*vars(norm).values(), *moments[:2])
    )
    return (x - mean) / np.sqrt(variance + 1e-3) * scale + bias


def time_features(field, time):
    frequencies = np.array([10 ** (-4 * i / 15) for i in range(16)])
    waves = np.concatenate([np.sin(time * frequencies), np.cos(time * frequencies)])
    return dense(field.time_outer, swish(dense(field.time_inner, waves)))


def velocity(field, moments, observations, sample, time):
    """Gate times (candidate - sample), both from [BRN(observation), BRN(sample), time features]."""
    normalised = [
        renorm(field.observation_norm, moments.observation, observations),
        renorm(field.sample_norm, moments.sample, sample),
        np.broadcast_to(time_features(field, time), (*sample.shape[:-1], 32)),
    ]
    hidden = swish(dense(field.inner, np.concatenate(normalised, axis=-1)))
    of_gate, of_candidate = np.split(hidden, 2, axis=-1)
    gate = 1 / (1 + np.exp(-dense(field.gate, of_gate)))
    return gate * (dense(field.candidate, of_candidate) - sample)


def log_deviation(network, observations):
    hidden = np.maximum(dense(network.first, observations), 0)
    hidden = np.maximum(dense(network.second, hidden), 0)
    return -5 + 3.5 * (np.tanh(dense(network.last, hidden)) + 1)


def path(actor, moments, observations, noise):
    """The samples x_0 ... x_M, the mean of each step, and the deviation they share."""
    deviation = np.exp(log_deviation(actor.deviation, observations))
    samples, means = [np.asarray(noise.start, np.float64)], []
    for step in range(len(noise.steps)):
        time = step / len(noise.steps)
        means.append(
            samples[-1] + velocity(actor.field, moments, observations, samples[-1], time) / len(noise.steps)
        )
        samples.append(means[-1] + deviation * np.asarray(noise.steps[step], np.float64))
    return samples, means, deviation
