"""Batch renormalisation against numbers worked out by hand: plain at first, corrected after the warm-up."""

import jax
import numpy as np
from jax import numpy as jnp

from hcpg.networks.batch_renorm import WARMUP_CALLS, BatchRenorm, Moments

NORM = BatchRenorm.create(1)
FRESH = Moments.create(1)
WARM = FRESH._replace(calls=jnp.int32(WARMUP_CALLS))


def column(*numbers):
    return jnp.asarray(numbers, jnp.float32)[:, None]


def test_before_the_warm_up_it_is_plain_batch_normalisation():
    y, _ = NORM.train(FRESH, column(0, 2))  # mean 1, variance 1: (x - 1) / sqrt(1.001)
    np.testing.assert_allclose(y[:, 0], [-0.9995004, 0.9995004], atol=1e-6)


def test_running_moments_move_by_one_hundredth_with_the_biased_variance():
    _, after = NORM.train(FRESH, column(0, 4))  # mean 2, biased variance 4
    np.testing.assert_allclose([after.mean[0], after.variance[0]], [0.02, 0.99 + 0.04], atol=1e-6)
    assert int(after.calls) == 1


def test_four_calls_at_once_leave_the_moments_of_four_calls_in_sequence():
    x = column(0, 4)
    _, at_once = NORM.train(FRESH, x, calls=4)
    in_sequence = FRESH
    for _ in range(4):
        _, in_sequence = NORM.train(in_sequence, x)
    assert int(at_once.calls) == int(in_sequence.calls) == 4
    np.testing.assert_allclose(at_once.mean, [2 * (1 - 0.99**4)], rtol=1e-6)
    np.testing.assert_allclose(at_once.mean, in_sequence.mean, rtol=1e-5)
    np.testing.assert_allclose(at_once.variance, in_sequence.variance, rtol=1e-5)


def test_the_correction_starts_with_call_one_hundred_thousand():
    x = column(0, 4)  # r = sqrt(4.001 / 1.001), d = 2 / sqrt(1.001): together x / sqrt(1.001)
    before, _ = NORM.train(FRESH._replace(calls=jnp.int32(99_999)), x)
    after, _ = NORM.train(FRESH._replace(calls=jnp.int32(100_000)), x)
    np.testing.assert_allclose(before[:, 0], [-0.999875, 0.999875], atol=1e-5)
    np.testing.assert_allclose(after[:, 0], [0.0, 3.998002], atol=1e-5)


def test_the_correction_is_clipped_at_three_and_five():
    y, _ = NORM.train(WARM, column(990, 1010))  # standard deviation 10 -> r = 3, mean 1000 -> d = 5
    np.testing.assert_allclose(y[:, 0], [5 - 3.0, 5 + 3.0], atol=1e-3)
    y, _ = NORM.train(WARM, column(-1000, -1000))  # no deviation: r = 1 / 3, d = -5
    np.testing.assert_allclose(y[:, 0], [-5.0, -5.0], atol=1e-5)


def test_no_gradient_flows_through_the_correction():
    x = column(0, 4, 5)
    ratio = np.sqrt((np.var([0, 4, 5]) + 1e-3) / 1.001)

    def third_power(x, moments):
        y, _ = NORM.train(moments, x)
        return (y[0] ** 3).sum(), y

    (slope, y), (warm_slope, warm_y) = (
        jax.grad(third_power, has_aux=True)(x, each) for each in (FRESH, WARM)
    )
    # y_warm = r * y + d with r and d constant: dy_warm^3 = 3 * y_warm^2 * r * dy
    expected = slope / (3 * y[0] ** 2) * 3 * warm_y[0] ** 2 * ratio
    np.testing.assert_allclose(warm_slope, expected, rtol=1e-4, atol=1e-6)


def test_inference_uses_the_running_moments_scale_and_bias():
    moments = Moments(jnp.array([3.0]), jnp.array([4.0]), jnp.int32(7))
    norm = BatchRenorm(jnp.array([2.0]), jnp.array([0.5]))
    np.testing.assert_allclose(norm.infer(moments, column(5)), [[2 * 2 / np.sqrt(4.001) + 0.5]], rtol=1e-6)


def test_a_row_at_inference_does_not_depend_on_its_neighbours_but_in_training_it_does():
    moments = Moments(jnp.array([3.0]), jnp.array([4.0]), jnp.int32(7))
    alone, among = NORM.infer(moments, column(5)), NORM.infer(moments, column(5, 100))
    assert float(alone[0, 0]) == float(among[0, 0])
    assert float(NORM.train(moments, column(5))[0][0, 0]) == 0.0  # its own mean
    np.testing.assert_allclose(NORM.train(moments, column(5, 100))[0][0, 0], -1.0, atol=1e-5)
