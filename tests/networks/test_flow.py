"""The flow actor: its path against NumPy, its path density against scipy, its noise, its slopes on paper."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp
from numpy_flow import path as path_in_numpy
from scipy import stats

from hcpg.networks.dense import Dense
from hcpg.networks.flow import Noise, path_log_prob
from hcpg.networks.gaussian import tanh_log_slope

ROWS = 6
LOG_TWO_PI_E = np.log(2 * np.pi * np.e)


@pytest.fixture(scope="module")
def observations():
    return jax.random.normal(jax.random.key(6), (ROWS, 5))


@pytest.fixture(scope="module")
def noise():
    return Noise.draw(jax.random.key(7), (ROWS, 3), 4)


def entropy(noise, log_deviation):
    """Of the path whose steps share one deviation, with the tanh correction (the same for all) taken out."""
    end = jnp.zeros(noise.start.shape)
    return (
        -path_log_prob(noise, len(noise.steps) * log_deviation, end).mean()
        - tanh_log_slope(end).sum(axis=-1).mean()
    )


def test_the_path_density_is_that_of_its_gaussian_steps(actor, moments, observations, noise):
    samples, means, deviation = path_in_numpy(actor, moments, np.asarray(observations), noise)
    expected = stats.norm.logpdf(samples[0]).sum(axis=-1)
    for sample, mean in zip(samples[1:], means, strict=True):
        expected += stats.norm.logpdf(sample, mean, deviation).sum(axis=-1)
    expected -= np.log(1 - np.tanh(samples[-1]) ** 2 + 1e-6).sum(axis=-1)
    path = actor.infer(moments, observations, noise)
    np.testing.assert_allclose(path.actions, np.tanh(samples[-1]), atol=2e-5)
    np.testing.assert_allclose(path.log_prob, expected, atol=1e-4, rtol=2e-5)


def test_path_entropy_rises_by_steps_times_actions_per_unit_of_log_deviation():
    noise = Noise.draw(jax.random.key(8), (10, 4), 4)
    rise = [entropy(noise, jnp.full((10, 4), level)) for level in (-1.01, -0.99)]
    np.testing.assert_allclose((rise[1] - rise[0]) / 0.02, 4 * 4, rtol=1e-3)


def test_the_path_density_is_not_the_density_of_the_action():
    """One step of zero velocity: x_1 = x_0 + s * e, whose own deviation is sqrt(1 + s^2)."""
    deviation, draws = 0.5, 200_000
    noise = Noise.draw(jax.random.key(9), (draws, 1), 1)
    joint = 0.5 * LOG_TWO_PI_E + 0.5 * LOG_TWO_PI_E + np.log(deviation)  # 2.1447
    marginal = 0.5 * LOG_TWO_PI_E + 0.5 * np.log(1 + deviation**2)  # 1.5305
    measured = float(entropy(noise, jnp.full((draws, 1), np.log(deviation))))
    assert abs(measured - joint) < 0.01  # standard error 1 / sqrt(200,000) = 0.0022
    assert abs(measured - marginal) > 0.6


def test_one_training_pass_of_four_steps_counts_four_calls(actor, observations, noise):
    """Deviation from a norm over [observation, sample]: the observation's part moves four times at once."""
    start = actor.moments()
    _, after = actor.train(start, observations, noise)
    assert int(after.observation.calls) == int(after.sample.calls) == 4
    mean = np.asarray(observations).mean(axis=0)
    np.testing.assert_allclose(after.observation.mean, mean * (1 - 0.99**4), rtol=1e-4, atol=1e-7)


def test_in_training_the_samples_of_all_steps_move_one_shared_statistic(fresh_actor, observations, noise):
    """A field of gate 0 and no deviation stays where it began: four equal calls of the sample's norm."""
    shut = eqx.tree_at(lambda actor: actor.field.gate.bias, fresh_actor, jnp.full(3, -50.0))
    still = eqx.tree_at(lambda actor: actor.deviation.last, shut, Dense.constant(8, 3, -50.0))
    _, after = still.train(still.field.moments(), observations, noise)
    mean = np.asarray(noise.start).mean(axis=0)
    np.testing.assert_allclose(after.sample.mean, mean * (1 - 0.99**4), rtol=0.2, atol=1e-3)


def test_a_row_acted_on_alone_equals_the_row_in_a_batch(actor, moments, observations, noise):
    every = actor.infer(moments, observations, noise)
    alone = actor.infer(moments, observations[2:3], Noise(noise.start[2:3], noise.steps[:, 2:3]))
    np.testing.assert_allclose(alone.actions[0], every.actions[2], atol=1e-6)
    np.testing.assert_allclose(alone.log_prob[0], every.log_prob[2], rtol=1e-5)


def test_in_training_a_row_depends_on_the_batch(actor, moments, observations, noise):
    other = observations.at[0].add(10.0)
    paths = [actor.train(moments, each, noise)[0].actions[2] for each in (observations, other)]
    assert float(abs(paths[0] - paths[1]).max()) > 1e-3


def test_one_observation_serves_many_proposals(actor, moments, observations, noise):
    repeated = jnp.broadcast_to(observations[:1], observations.shape)
    np.testing.assert_allclose(
        actor.infer(moments, observations[:1], noise).actions,
        actor.infer(moments, repeated, noise).actions,
        atol=1e-6,
    )


def test_the_deviation_depends_on_the_raw_observation_alone(actor, moments, observations, noise):
    """Other statistics change the velocity and so the end, but not the density of the steps."""
    other = jax.tree.map(lambda leaf: leaf * 2, moments)
    paths = [actor.infer(each, observations, noise) for each in (moments, other)]
    ends = [jnp.arctanh(path.actions) for path in paths]
    steps = [path.log_prob + tanh_log_slope(end).sum(-1) for path, end in zip(paths, ends, strict=True)]
    assert float(abs(ends[0] - ends[1]).max()) > 0.05
    np.testing.assert_allclose(steps[0], steps[1], atol=2e-3)
    scaled = actor.deviation.log(10 * observations) - actor.deviation.log(observations)
    assert float(abs(scaled).max()) > 0.1


def test_the_deviation_stays_within_its_range(actor, observations):
    logs = actor.deviation.log(1e4 * observations)
    assert float(logs.min()) >= -5.0
    assert float(logs.max()) <= 2.0
    centre = eqx.tree_at(lambda network: network.last, actor.deviation, Dense.constant(8, 3, 0.0))
    np.testing.assert_allclose(centre.log(observations), np.full((ROWS, 3), -1.5))


def test_the_gradient_by_a_nudge_is_that_by_the_sample_it_moves(actor, moments, observations, noise):
    """The end's own gradient of the sum of its squares is 2 x_M; the start's is that by the start's noise."""

    def squares(nudges, start):
        moved = Noise(start, noise.steps)
        path, _ = actor.train(moments, observations, moved, nudges)
        return jnp.square(jnp.arctanh(path.actions)).sum()

    nudges = jnp.zeros((5, *noise.start.shape))
    by_nudges, by_start = jax.grad(squares, argnums=(0, 1))(nudges, noise.start)
    end = jnp.arctanh(actor.train(moments, observations, noise)[0].actions)
    np.testing.assert_allclose(by_nudges[-1], 2 * end, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(by_nudges[0], by_start, rtol=1e-4, atol=1e-5)
    assert float(abs(by_nudges[1] - by_nudges[2]).max()) > 1e-3


def test_two_keys_share_no_step_of_noise():
    one, two = (Noise.draw(jax.random.key(seed), (ROWS, 3), 4) for seed in (0, 1))
    assert not (one.start == two.start).any()
    assert not (one.steps == two.steps).any()


def test_noise_is_uncorrelated_over_steps_samples_and_actions():
    draws = 10_000
    noise = Noise.draw(jax.random.key(10), (draws, 2, 2), 3)
    every = np.concatenate([noise.start[None], noise.steps])  # 4 times, draws, 2 samples, 2 actions
    columns = np.moveaxis(every, 1, 0).reshape(draws, -1)
    correlation = np.corrcoef(columns, rowvar=False) - np.eye(16)
    assert np.abs(correlation).max() < 4 / np.sqrt(draws)
    np.testing.assert_allclose(columns.std(axis=0), 1.0, atol=0.04)


def test_the_open_gate_lets_0_319_of_the_start_through(fresh_actor, observations, noise):
    """A candidate of zero: each of four steps keeps 1 - 0.25 * 0.9933071 of the sample."""
    field = eqx.tree_at(lambda actor: actor.field.candidate, fresh_actor, Dense.constant(8, 3, 0.0))

    def end(start):
        small = Noise(start[None], 0 * noise.steps[:, :1])
        return jnp.arctanh(field.infer(field.field.moments(), observations[:1], small).actions)[0]

    slope = jax.jacobian(end)(jnp.array([0.1, -0.2, 0.3]))
    np.testing.assert_allclose(slope, np.eye(3) * (1 - 0.25 * 0.9933071) ** 4, atol=1e-4)
    assert abs(float(slope[0, 0]) - 0.319) < 0.0005
