"""The tanh-Gaussian: its density on a grid and against PyTorch, its deviation's bounds, its proposals."""

import equinox as eqx
import jax
import numpy as np
import pytest
import torch
from jax import numpy as jnp
from scipy import stats
from torch import distributions

from hcpg.networks.dense import Dense
from hcpg.networks.gaussian import GaussianActor, TanhGaussian, bounded_log_deviation, tanh_log_slope

LOG_PEAK = -0.5 * np.log(2 * np.pi)


@pytest.fixture(scope="module")
def actor():
    return GaussianActor.create(jax.random.key(0), (5, 2), [8, 8, 8])


@pytest.mark.parametrize(("mean", "deviation"), [(0.0, 1.0), (0.7, 0.3), (-1.0, 0.05), (0.5, 1.5)])
def test_the_density_of_the_action_integrates_to_one(mean, deviation):
    grid = jnp.linspace(-6.0, 6.0, 4001)[:, None]
    found = TanhGaussian(jnp.array([mean]), jnp.log(jnp.array([deviation]))).sample(grid)
    actions, density = (np.asarray(each, np.float64) for each in (found.actions[:, 0], found.log_prob))
    assert abs(np.trapezoid(np.exp(density), actions) - 1) < 1e-3


def test_the_density_is_that_of_torchs_transformed_normal():
    generator = np.random.default_rng(0)
    mean, log_deviation, noise = np.clip(generator.normal(size=(3, 7, 4)), -1.2, 1.2) * 0.7
    normal = distributions.Normal(torch.tensor(mean), torch.tensor(np.exp(log_deviation)))
    squashed = distributions.TransformedDistribution(normal, distributions.TanhTransform(cache_size=1))
    actions = torch.tanh(torch.tensor(mean + np.exp(log_deviation) * noise))
    own = TanhGaussian(*(jnp.asarray(each, jnp.float32) for each in (mean, log_deviation)))
    found = own.sample(jnp.asarray(noise, jnp.float32))
    np.testing.assert_allclose(found.actions, actions, atol=1e-6)
    np.testing.assert_allclose(found.log_prob, squashed.log_prob(actions).sum(-1), atol=2e-4)  # floor: 1e-6


def test_the_density_at_the_mean_by_hand():
    """Deviations 1 and e, mean 0 (slope 1): the two peaks, the second lower by one nat."""
    found = TanhGaussian(jnp.zeros(2), jnp.array([0.0, 1.0])).sample(jnp.zeros(2))
    np.testing.assert_allclose(found.log_prob, 2 * LOG_PEAK - 1, atol=1e-5)
    np.testing.assert_array_equal(found.actions, [0.0, 0.0])


def test_the_raw_log_deviation_is_squashed_by_tanh_not_clipped():
    """A clip to [-20, 2] would answer -10 and 2 at -10 and 10, and -1 at -1."""
    raw = jnp.array([-10.0, -1.0, 0.0, 10.0])
    np.testing.assert_allclose(bounded_log_deviation(raw), [-5.0, -4.165580, -1.5, 2.0], atol=1e-5)
    slope = jax.grad(lambda x: bounded_log_deviation(x).sum())(jnp.array([0.0, 3.0]))
    np.testing.assert_allclose(slope, [3.5, 3.5 * (1 - np.tanh(3.0) ** 2)], rtol=1e-4)


def test_the_networks_first_half_is_the_mean_and_its_second_the_raw_log_deviation(actor):
    bias = jnp.array([0.5, -4.0, 10.0, -10.0])
    last = Dense(jnp.zeros((8, 4)), bias)
    fixed = eqx.tree_at(lambda actor: actor.network.layers[3], actor, last)
    found = fixed(jnp.ones((3, 5)))
    np.testing.assert_allclose(found.mean, [[0.5, -4.0]] * 3)
    np.testing.assert_allclose(found.log_deviation, [[2.0, -5.0]] * 3, atol=1e-5)


def test_one_observation_serves_many_samples(actor):
    noise = jax.random.normal(jax.random.key(1), (6, 2))
    observation = jnp.linspace(-1.0, 1.0, 5)
    one = actor(observation).sample(noise)
    many = actor(jnp.broadcast_to(observation, (6, 5))).sample(noise)
    np.testing.assert_allclose(one.actions, many.actions, atol=1e-6)
    np.testing.assert_allclose(one.log_prob, many.log_prob, atol=1e-5)


def test_the_tanh_correction_is_that_of_a_change_of_variables():
    """tanh bounds to (-2, 2): the histogram of 2 tanh(x) is the normal density over the slope."""
    x = np.random.default_rng(0).normal(size=1_000_000)
    counts, edges = np.histogram(2 * np.tanh(x), bins=40, range=(-1.6, 1.6))
    at = np.arctanh((edges[:-1] + edges[1:]) / 2 / 2)
    density = np.exp(stats.norm.logpdf(at) - np.asarray(tanh_log_slope(jnp.asarray(at, jnp.float32), 2.0)))
    np.testing.assert_allclose(counts / len(x) / (edges[1] - edges[0]), density, rtol=0.03)


def test_a_wider_range_adds_its_logarithm_to_the_correction():
    x = jnp.array([-1.0, 0.0, 0.5])
    offset = tanh_log_slope(x, 3.0) - tanh_log_slope(x)
    np.testing.assert_allclose(offset, np.full(3, np.log(3.0)), atol=1e-5)


def test_the_correction_and_its_slope_are_exact_where_tanh_saturates():
    """1 - tanh^2 is 2.4576e-5 at 6 and 4.5014e-7 at 8, where float32 knows no tanh but 1."""
    x = jnp.array([6.0, -6.0, 8.0, -8.0, 80.0])
    slope, rise = tanh_log_slope(x), jax.grad(lambda each: tanh_log_slope(each).sum())(x)
    np.testing.assert_allclose(slope, [-10.57392, -10.57392, -13.44387, -13.44387, np.log(1e-6)], atol=1e-4)
    np.testing.assert_allclose(rise, [-1.92178, 1.92178, -0.62082, 0.62082, 0.0], atol=1e-4)
