"""The midpoint rule on fields whose paths are known, the bounded noise, the flow and its matching error."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.midpoint import MidpointFlow, clamped_normal, integrate

OBSERVATIONS, ACTIONS = 5, 3


@pytest.fixture(scope="module")
def still():
    """A flow of two steps whose velocity is 0 everywhere."""
    flow = MidpointFlow.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), 8, 2)
    return eqx.tree_at(lambda flow: flow.field.layers[-1].kernel, flow, replace_fn=jnp.zeros_like)


def test_the_midpoint_rule_is_exact_where_the_velocity_is_the_time():
    """Euler's rule gives 0 in one step and 1/4 in two."""
    for steps in (1, 2):
        end = integrate(lambda samples, time: jnp.full_like(samples, time), jnp.zeros(2), steps)
        np.testing.assert_allclose(end, [0.5, 0.5], rtol=1e-6)


def test_the_midpoint_rule_is_of_second_order_where_the_velocity_is_the_sample():
    for steps in (1, 4):
        end = integrate(lambda samples, time: samples, jnp.ones(1), steps)
        growth = 1 + 1 / steps + 0.5 / steps**2  # (1 + 1/steps)^steps would be Euler's
        np.testing.assert_allclose(end, [growth**steps], rtol=1e-6)


def test_one_step_sees_the_field_at_time_zero_and_at_one_half():
    seen = []

    def velocity(samples, time):
        seen.append((float(samples[0]), time))
        return 4 * samples

    end = integrate(velocity, jnp.ones(1), 1)
    assert seen == [(1.0, 0.0), (3.0, 0.5)]
    assert end.tolist() == [1.0 + 12.0]


def test_two_steps_see_the_field_at_four_times():
    seen = []
    integrate(lambda samples, time: seen.append(time) or samples, jnp.ones(1), 2)
    assert seen == [0.0, 0.25, 0.5, 0.75]


def test_a_third_of_the_clamped_noise_lies_on_the_bounds():
    drawn = clamped_normal(jax.random.key(0), (50_000, 2))
    assert (float(drawn.min()), float(drawn.max())) == (-1.0, 1.0)
    np.testing.assert_allclose((abs(drawn) == 1.0).mean(), 0.3173, atol=4 * np.sqrt(0.3173 * 0.6827 / 1e5))
    np.testing.assert_allclose(jnp.square(drawn).mean(), 0.5161, atol=0.005)  # 1 - 2 * density at 1


def test_actions_are_tanh_of_the_end_once(still):
    start = jnp.array([[1.0, 0.5, -1.0]])
    found = still.actions(jnp.ones((1, OBSERVATIONS)), start)
    np.testing.assert_allclose(found, [[0.7615942, 0.4621172, -0.7615942]], rtol=1e-5)


def test_the_matching_error_of_a_still_field_is_the_lines_mean_square(still):
    actions, start = jnp.array([[1.0, 1.0, -1.0]]), jnp.array([[0.0, 1.0, 1.0]])
    found = still.matching_errors(jnp.ones((1, OBSERVATIONS)), actions, start, jnp.array([0.3]))
    np.testing.assert_allclose(found, [(1 + 0 + 4) / 3], rtol=1e-6)


def test_the_matching_error_is_taken_on_the_line_at_the_drawn_time():
    """A field that answers with one of its inputs shows what it was given."""
    flow = MidpointFlow.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), 8, 1)
    asked = []

    def field(x):
        asked.append(x)
        return jnp.zeros((2, ACTIONS))

    watched = eqx.tree_at(lambda flow: flow.field, flow, field)
    observations = jnp.arange(10.0).reshape(2, OBSERVATIONS)
    actions, start = jnp.full((2, ACTIONS), 1.0), jnp.full((2, ACTIONS), -1.0)
    MidpointFlow.matching_errors(watched, observations, actions, start, jnp.array([0.25, 0.5]))
    np.testing.assert_array_equal(asked[0][:, :OBSERVATIONS], observations)
    np.testing.assert_allclose(asked[0][:, OBSERVATIONS:-1], [[-0.5] * 3, [0.0] * 3])
    np.testing.assert_allclose(asked[0][:, -1], [0.25, 0.5])


def test_the_noise_of_a_sample_moves_its_action_through_both_network_calls(still):
    """With a zero field the slope is that of tanh alone; a field that follows the sample adds to it."""
    slope = jax.grad(lambda start: still.actions(jnp.ones((1, OBSERVATIONS)), start)[0, 0])
    found = slope(jnp.full((1, ACTIONS), 0.5))
    np.testing.assert_allclose(found, [[1 - np.tanh(0.5) ** 2, 0.0, 0.0]], rtol=1e-5)
    end = jax.grad(lambda start: integrate(lambda samples, time: samples, start, 1)[0])
    np.testing.assert_allclose(end(jnp.ones(1)), [2.5])
