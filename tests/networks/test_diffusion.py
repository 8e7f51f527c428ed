"""The chain's constants by hand, the clock's features, and what the clipped sampler makes of a constant."""

from functools import cache, partial

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.dense import Dense
from hcpg.networks.diffusion import TIME_FREQUENCIES, TIME_SIZE, Chain, Clock, Denoiser, mish

OBSERVATIONS, ACTIONS, HIDDEN = 3, 2, 8
BETAS = [0.19588, 0.45882, 0.63578, 0.75488, 0.83503]
# exp of minus the running sum of 0.218, 0.614, 1.010, 1.406, 1.802
KEPT = [0.80413, 0.43518, 0.15850, 0.03885, 0.00641]


@cache
def denoiser(steps=5):
    create = partial(Denoiser.create, sizes=(OBSERVATIONS, ACTIONS), hidden_size=HIDDEN, steps=steps)
    return jax.jit(create)(jax.random.key(0))


def constant(value, steps=5):
    """A denoiser that predicts `value` everywhere."""
    return eqx.tree_at(lambda net: net.last, denoiser(steps), Dense.constant(HIDDEN, ACTIONS, value))


def test_the_schedule_is_the_published_one():
    chain = Chain.of(5)
    np.testing.assert_allclose(chain.betas, BETAS, atol=1e-5)
    np.testing.assert_allclose(chain.kept, KEPT, atol=1e-5)


def test_a_reverse_step_takes_out_the_published_share_of_the_noise():
    chain, none, one = Chain.of(5), jnp.zeros(1), jnp.ones(1)
    shares = [-float(chain.denoise(none, one, step)[0]) for step in range(5)]
    np.testing.assert_allclose(shares, [0.49355, 0.82988, 1.14842, 1.55522, 2.06252], atol=1e-4)
    growth = [float(chain.denoise(one, none, step)[0]) for step in range(5)]
    np.testing.assert_allclose(growth, 1 / np.sqrt(1 - np.array(BETAS)), atol=1e-4)


def test_forward_steps_keep_the_tables_share_of_the_action_and_leave_the_box():
    chain, times = Chain.of(5), jnp.arange(5)
    of_action = chain.diffuse(jnp.ones((5, 1)), jnp.zeros((5, 1)), times)[:, 0]
    of_noise = chain.diffuse(jnp.zeros((5, 1)), 3 * jnp.ones((5, 1)), times)[:, 0]
    np.testing.assert_allclose(np.square(of_action), KEPT, atol=1e-5)
    np.testing.assert_allclose(np.square(of_noise), 9 * (1 - np.array(KEPT)), atol=1e-4)
    assert float(of_noise.min()) > 1


def test_the_clock_counts_in_whole_steps():
    clock = denoiser().clock
    features, turns = clock.features(3), 2 * np.pi * np.asarray(clock.frequencies)
    assert features.shape == (3, 2 * TIME_FREQUENCIES)
    np.testing.assert_array_equal(features[0], np.repeat([1.0, 0.0], TIME_FREQUENCIES))
    np.testing.assert_allclose(features[1], np.concatenate([np.cos(turns), np.sin(turns)]), atol=1e-6)
    np.testing.assert_allclose(features[2], np.concatenate([np.cos(2 * turns), np.sin(2 * turns)]), atol=1e-6)
    assert clock.codes(3).shape == (3, TIME_SIZE)


def test_frequencies_are_normal_with_deviation_a_fifth():
    drawn = jax.jit(jax.vmap(Clock.create))(jax.random.split(jax.random.key(4), 40)).frequencies
    assert abs(np.std(drawn) - 0.2) < 4 * 0.2 / np.sqrt(2 * 40 * TIME_FREQUENCIES)
    assert abs(np.mean(drawn)) < 4 * 0.2 / np.sqrt(40 * TIME_FREQUENCIES)


def test_kernels_start_xavier_uniform_and_biases_at_zero():
    create = partial(Denoiser.create, sizes=(39, 4), hidden_size=64, steps=5)
    net = jax.jit(create)(jax.random.key(1))
    for layer in (net.first, net.second, *net.clock.network.layers):
        bound = np.sqrt(6 / sum(layer.kernel.shape))
        assert 0.98 * bound < float(abs(layer.kernel).max()) <= bound
        np.testing.assert_allclose(layer.kernel.std(), bound / np.sqrt(3), rtol=0.05)
        assert not layer.bias.any()
    assert net.first.kernel.shape == (4 + 39 + 128, 64)


def test_a_prediction_is_that_of_the_plain_network_on_action_observation_and_code():
    net, keys = denoiser(), jax.random.split(jax.random.key(2), 2)
    observations = jax.random.normal(keys[0], (6, OBSERVATIONS))
    actions, times = jax.random.normal(keys[1], (6, ACTIONS)), np.array([0, 4, 2, 1, 3, 0])
    code = np.asarray(net.clock.codes(5))[times]
    hidden = np.concatenate([actions, observations, code], axis=-1)
    for layer in (net.first, net.second):
        hidden = np.asarray(jax.nn.mish(hidden @ layer.kernel + layer.bias))
    expected = hidden @ net.last.kernel + net.last.bias
    found = jax.jit(Denoiser.predict)(net, observations, actions, jnp.asarray(times))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_mish_is_mish_and_so_is_its_slope():
    x = jnp.array([-100.0, -20.0, -3.0, -0.5, 0.0, 0.5, 3.0, 19.9, 20.1, 100.0])
    np.testing.assert_allclose(mish(x), jax.nn.mish(x), rtol=1e-5, atol=1e-8)
    slopes, expected = (jax.vmap(jax.grad(each))(x) for each in (mish, jax.nn.mish))
    np.testing.assert_allclose(slopes, expected, rtol=1e-5, atol=1e-7)


# Mean, deviation and share at a bound where the denoiser predicts -G, from a NumPy simulation of the clipped
# chain with 4 million samples that shares no code with this package.
STATISTICS = {
    0.0: (0.0, 0.8925, 0.6693),
    0.25: (0.3646, 0.8222, 0.5304),
    0.5: (0.6755, 0.6205, 0.7180),
    1.0: (0.9622, 0.2042, 0.9514),
}


sample = jax.jit(Denoiser.sample)


@pytest.fixture(scope="module")
def samples():
    """[100000, 2] by G."""
    noise = jax.random.normal(jax.random.key(3), (5, 100_000, ACTIONS))
    return {gain: sample(constant(-gain), jnp.zeros((1, OBSERVATIONS)), noise) for gain in (*STATISTICS, 2.0)}


@pytest.mark.parametrize("gain", STATISTICS)
def test_a_constant_prediction_drives_the_samples_to_the_bound(samples, gain):
    mean, deviation, bound = STATISTICS[gain]
    np.testing.assert_allclose(samples[gain].mean(axis=0), mean, atol=0.01)
    np.testing.assert_allclose(samples[gain].std(axis=0), deviation, atol=0.01)
    np.testing.assert_allclose((abs(samples[gain]) == 1).mean(axis=0), bound, atol=0.01)
    assert float(abs(samples[gain]).max()) == 1.0


def test_a_prediction_of_two_leaves_nothing_but_the_bound(samples):
    assert float(samples[2.0].mean()) > 0.995


def test_the_last_step_adds_no_noise():
    # One step, nothing predicted: x / sqrt(1 - beta), 1 - beta = exp(-0.1 - 9.9 / 2), then clipped.
    start = jnp.array([[[0.05, -0.3]]])
    found = sample(constant(0.0, steps=1), jnp.zeros((1, OBSERVATIONS)), start)
    np.testing.assert_allclose(found, [[0.05 * np.exp(5.05 / 2), -1.0]], rtol=1e-5)


def test_every_step_but_the_last_adds_noise_of_its_own_deviation():
    # From 0 with a prediction of 0, noise of 1e-4 in one step only: what arrives is its deviation times all
    # later growth.
    noise = 1e-4 * jnp.eye(5)[:, :, None] * jnp.ones(ACTIONS)  # sample k has noise k alone
    found = sample(constant(0.0), jnp.zeros((1, OBSERVATIONS)), noise)[:, 0]
    growth = 1 / np.sqrt(1 - np.array(BETAS))
    deviations = [1.0, *np.sqrt(BETAS)[:0:-1]]
    later = [np.prod(growth[: 5 - k]) for k in range(5)]
    np.testing.assert_allclose(found, 1e-4 * np.array(deviations) * later, rtol=1e-3)
