"""One gradient step: Adam's first one has the length of the learning rate, whatever the slope."""

from typing import NamedTuple

import jax
import numpy as np
import optax
from jax import numpy as jnp

from hcpg.networks.descent import count_update, descend, follow


class Counted(NamedTuple):
    """A state that notes at which updates it was improved."""

    updates: jax.Array
    improved: jax.Array


def test_adams_first_step_is_the_learning_rate_against_the_sign():
    parameters, optimizer = jnp.array([1.0, 1.0, 1.0]), optax.adam(0.01, b1=0.5)
    moved, _ = descend(optimizer, jnp.array([1e-3, -4.0, 0.0]), optimizer.init(parameters), parameters)
    np.testing.assert_allclose(moved, [0.99, 1.01, 1.0], atol=1e-6)


def test_the_second_step_remembers_the_first():
    optimizer = optax.adam(0.01, b1=0.5)
    state, parameter = optimizer.init(jnp.array(0.0)), jnp.array(0.0)
    for gradient in (1.0, -1.0):
        parameter, state = descend(optimizer, jnp.array(gradient), state, parameter)
    # m = (0.5 * 0.5 - 0.5) / (1 - 0.25) = -1 / 3, v = 1: back by a third of the first step
    np.testing.assert_allclose(parameter, -0.01 + 0.01 / 3, atol=1e-7)


def test_a_follower_moves_by_its_rate_towards_what_it_follows():
    found = follow({"a": jnp.array([1.0, 0.0])}, {"a": jnp.array([0.0, 2.0])}, 0.95)
    np.testing.assert_allclose(found["a"], [0.05, 1.9], rtol=1e-6)


def test_every_third_update_improves_the_counted_state_and_the_others_report_nothing():
    def improve(state):
        return state._replace(improved=10 * state.improved + state.updates), {"loss": jnp.float32(2.0)}

    state, losses = Counted(jnp.int32(0), jnp.int32(0)), []
    for _ in range(6):
        state, metrics = jax.jit(lambda state: count_update(state, 3, improve, ("loss",)))(state)
        losses.append(float(metrics["loss"]))
    assert (int(state.updates), int(state.improved)) == (6, 36)
    np.testing.assert_array_equal(losses, [np.nan, np.nan, 2.0, np.nan, np.nan, 2.0])
