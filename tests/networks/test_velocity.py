"""The gated velocity: the formula written out unfused, and the open gate it starts with."""

import jax
import numpy as np
from jax import numpy as jnp
from numpy_flow import time_features, velocity

from hcpg.networks.velocity import _fourier

TIMES = jnp.array([0.0, 0.25, 0.5, 0.75])


def of_field(field, moments, observations, sample):
    """The field's own velocity at the four times."""
    drive = field.drive(field.observation_norm.infer(moments.observation, observations), TIMES)
    normalised = field.sample_norm.infer(moments.sample, sample)
    return [field.velocity(drive[step], normalised, sample) for step in range(4)]


def test_the_fused_field_equals_the_formula(actor, moments):
    observations, sample = (
        jax.random.normal(jax.random.key(3), (6, 5)),
        jax.random.normal(jax.random.key(4), (6, 3)),
    )
    computed = of_field(actor.field, moments, observations, sample)
    expected = [
        velocity(actor.field, moments, np.asarray(observations), np.asarray(sample), t) for t in TIMES
    ]
    np.testing.assert_allclose(computed, expected, atol=2e-5)
    assert np.abs(expected[0] - expected[3]).max() > 1e-3  # the time does matter


def test_the_gate_starts_open_with_a_zero_kernel(fresh_actor):
    field = fresh_actor.field
    assert not field.gate.kernel.any()
    np.testing.assert_allclose(jax.nn.sigmoid(field.gate.bias), np.full(3, 0.9933071), atol=1e-6)


def test_the_velocity_starts_as_0_9933_of_candidate_minus_sample(fresh_actor):
    field, moments = fresh_actor.field, fresh_actor.field.moments()
    observations, sample = jax.random.normal(jax.random.key(5), (1, 5)), jnp.array([[1.0, -2.0, 3.0]])
    drive = field.drive(field.observation_norm.infer(moments.observation, observations), TIMES)
    inputs = field.sample_norm.infer(moments.sample, sample)
    hidden = drive[0] + inputs @ field.inner.kernel[5:8]
    candidate = field.candidate(jax.nn.swish(hidden[:, 8:]))
    np.testing.assert_allclose(
        field.velocity(drive[0], inputs, sample), 0.9933071 * (candidate - sample), rtol=1e-5
    )


def test_time_enters_as_sixteen_sines_and_cosines(fresh_actor):
    features = _fourier(jnp.array([0.0, 0.25]))
    np.testing.assert_allclose(features[0], [0.0] * 16 + [1.0] * 16)
    np.testing.assert_allclose(features[1, [0, 15, 16]], [np.sin(0.25), 0.25e-4, np.cos(0.25)], rtol=1e-4)
    assert time_features(fresh_actor.field, 0.5).shape == (32,)


def test_fresh_statistics_have_the_sizes_of_observation_and_action(fresh_actor):
    moments = fresh_actor.field.moments()
    assert moments.observation.mean.tolist() == [0.0] * 5
    assert moments.sample.variance.tolist() == [1.0] * 3
