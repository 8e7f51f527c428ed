"""The decoder field: its norms, its size, its density and the published defect, what time does to it."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp
from scipy import stats

from hcpg.networks.decoder_actor import DecoderActor, LoneAttention
from hcpg.networks.dense import Dense
from hcpg.networks.flow import Noise
from hcpg.networks.gaussian import tanh_log_slope

OBSERVATIONS, ACTIONS, STEPS, ROWS, SIZE = 5, 4, 4, 64, 8
train = jax.jit(lambda actor, *rest: actor.train(*rest))
infer = jax.jit(lambda actor, *rest: actor.infer(*rest))


@pytest.fixture(scope="module")
def actor():
    return DecoderActor.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), SIZE, STEPS)


@pytest.fixture(scope="module")
def published():
    return DecoderActor.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), SIZE, STEPS, "as_published")


@pytest.fixture(scope="module")
def noise():
    return Noise.draw(jax.random.key(1), (ROWS, ACTIONS), STEPS)


@pytest.fixture(scope="module")
def observations():
    return jax.random.normal(jax.random.key(2), (ROWS, OBSERVATIONS))


def entropy_gradient(actor, observations, noise):
    def entropy(actor):
        return -actor.train(actor.moments(), observations, noise)[0].log_prob.mean()

    return jax.jit(jax.grad(entropy))(actor)


def test_each_step_has_a_norm_of_its_own_and_the_layers_norms_are_shared(actor, observations, noise):
    _, after = train(actor, actor.moments(), observations, noise)
    assert int(after.observation.calls) == 1
    assert [int(each.calls) for each in after.samples] == [1, 1, 1, 1]
    assert [[int(each.calls) for each in layer] for layer in after.layers] == [[4, 4, 4], [4, 4, 4]]
    means = [np.asarray(each.mean) for each in after.samples]
    np.testing.assert_allclose(means[0], 0.01 * np.asarray(noise.start).mean(axis=0), rtol=1e-4, atol=1e-7)
    gaps = [abs(one - other).max() for index, one in enumerate(means) for other in means[:index]]
    assert min(gaps) > 1e-4


def test_its_size_is_the_published_one_less_the_queries_and_keys():
    """At observation 10, action 4: 311,052 numbers, of which 8 projections of 96 x 96 + 96 are idle."""
    actor = DecoderActor.create(jax.random.key(0), (10, 4), 96, 4)
    assert sum(leaf.size for leaf in jax.tree.leaves(actor)) == 311_052 - 8 * (96 * 96 + 96)


def test_attention_to_one_key_is_its_output_of_its_value():
    two, three = Dense(2 * jnp.eye(2), jnp.ones(2)), Dense(3 * jnp.eye(2), jnp.zeros(2))
    np.testing.assert_allclose(LoneAttention(two, three)(jnp.array([[1.0, -1.0]])), [[9.0, -3.0]])


def test_the_noise_reaches_the_sample_over_the_number_of_steps(actor, observations):
    """A last layer that says velocity 0 and log-deviation log(0.22): x_M - x_0 deviates by 0.055 sqrt(4)."""
    raw = float(np.arctanh((np.log(0.22) + 1.5) / 3.5))
    heads = Dense.constant(SIZE, ACTIONS, 0.0), Dense.constant(SIZE, ACTIONS, raw)
    still = eqx.tree_at(lambda actor: (actor.velocity, actor.deviation), actor, heads)
    noise = Noise.draw(jax.random.key(3), (4096, ACTIONS), STEPS)
    start = 0.1 * noise.start
    ends = jnp.arctanh(infer(still, still.moments(), observations[:1], Noise(start, noise.steps)).actions)
    np.testing.assert_allclose((ends - start).std(), 0.11, rtol=0.02)


def test_entropy_rises_by_actions_per_unit_of_each_steps_log_deviation(actor, published, observations, noise):
    """16 in all, since the raw output 0 moves the log-deviation by 3.5 per unit: 3.5 x 16 over the biases."""
    zero = Dense.constant(SIZE, ACTIONS, 0.0)
    far = Noise(noise.start, 0 * noise.steps)  # no noise, so the end does not move with the deviation
    for each, slope in ((actor, 3.5 * 16), (published, 0.0)):
        centred = eqx.tree_at(lambda actor: actor.deviation, each, zero)
        gradient = entropy_gradient(centred, observations, far)
        np.testing.assert_allclose(gradient.deviation.bias.sum(), slope, rtol=1e-5, atol=1e-6)


def test_the_published_entropy_is_a_constant_and_the_saturation(actor, published, observations, noise):
    """28.38 for four actions and four steps, plus the mean log-slope of tanh, whatever the deviations."""
    # Heads of zero: ends near the starts, where float32 can tell tanh from 1, and log-deviations of -1.5.
    zero = Dense.constant(SIZE, ACTIONS, 0.0)
    actor, published = (
        eqx.tree_at(lambda each: (each.velocity, each.deviation), each, (zero, zero))
        for each in (actor, published)
    )
    path = infer(published, published.moments(), observations, noise)
    saturation = np.asarray(tanh_log_slope(jnp.arctanh(path.actions))).sum(axis=-1)
    drawn = np.concatenate([noise.start[None], noise.steps])
    expected = stats.norm.logpdf(drawn).sum(axis=(0, 2)) - saturation
    np.testing.assert_allclose(path.log_prob, expected, atol=2e-3)
    constant = 20 * 0.5 * np.log(2 * np.pi * np.e)
    assert abs(constant - 28.38) < 0.01
    error = 4 * np.sqrt(20 / 2 / ROWS)  # four standard errors of the mean of half a chi-squared of 20
    assert abs(-float(path.log_prob.mean()) - constant - saturation.mean()) < error
    right = infer(actor, actor.moments(), observations, noise)
    np.testing.assert_array_equal(right.actions, path.actions)
    np.testing.assert_allclose(right.log_prob - path.log_prob, 16 * (1.5 + np.log(4)), rtol=1e-5)


def test_published_entropy_has_no_slope_by_a_deviation_that_moves_nothing(published, observations, noise):
    """What is left comes through the samples; with no noise to scale there is none, to the last bit."""
    gradient = entropy_gradient(published, observations, Noise(noise.start, 0 * noise.steps))
    np.testing.assert_array_equal(gradient.deviation.kernel, np.zeros((SIZE, ACTIONS)))
    np.testing.assert_array_equal(gradient.deviation.bias, np.zeros(ACTIONS))
    assert float(abs(gradient.velocity.kernel).max()) > 1e-3


def test_in_training_the_time_has_no_influence_since_the_first_norm_takes_it_out(actor, observations, noise):
    """All rows of a step share its time. In acting the running moments, shared by the steps, do show it."""
    timeless = eqx.tree_at(
        lambda actor: actor.of_time.layers[-1], actor, Dense.constant(SIZE // 2, SIZE, 0.0)
    )
    learning = [train(each, actor.moments(), observations, noise)[0].actions for each in (actor, timeless)]
    acting = [infer(each, actor.moments(), observations, noise).actions for each in (actor, timeless)]
    np.testing.assert_allclose(*learning, atol=1e-5)
    assert float(abs(acting[0] - acting[1]).max()) > 1e-2
    gradient = entropy_gradient(actor, observations, noise)
    assert float(abs(gradient.of_time.layers[-1].kernel).max()) < 1e-4
    assert float(abs(gradient.of_sample.kernel).max()) > 1e-2


def test_one_observation_serves_many_proposals_each_as_if_alone(actor, observations, noise):
    moments, one = actor.moments(), observations[:1]
    every = infer(actor, moments, jnp.broadcast_to(one, observations.shape), noise)
    np.testing.assert_allclose(infer(actor, moments, one, noise).actions, every.actions, atol=1e-5)
    alone = infer(actor, moments, one, Noise(noise.start[2:3], noise.steps[:, 2:3]))
    np.testing.assert_allclose(alone.actions[0], every.actions[2], atol=1e-5)
    np.testing.assert_allclose(alone.log_prob[0], every.log_prob[2], rtol=1e-5)
