"""The run axis: one run as without it, several as each alone, the count of updates shared."""

from typing import NamedTuple

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.loops.runs_axis import axes_of, over_runs, stack, take


class Weights(NamedTuple):
    values: dict
    updates: jax.Array


def single(level):
    return Weights({"a": jnp.full(3, level), "b": jnp.asarray(10 * level)}, jnp.int32(4))


def grow(state, amount, shared):
    values = jax.tree.map(lambda leaf: leaf + amount * shared, state.values)
    return Weights(values, state.updates + 1), values["b"]


def test_all_fields_but_the_count_have_the_axis():
    assert axes_of(Weights) == Weights(0, None)


def test_stacked_states_are_taken_apart_again():
    states = stack([single(1.0), single(2.0)])
    assert states.values["a"].shape == (2, 3)
    assert states.updates.shape == ()
    for run, level in enumerate((1.0, 2.0)):
        jax.tree.map(np.testing.assert_array_equal, take(states, run), single(level))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_function_of_one_run_serves_any_number(count):
    axes = axes_of(Weights)
    states = stack([single(float(level)) for level in range(count)])
    every = over_runs(grow, count, (axes, 0, None), (axes, 0))
    after, told = every(states, jnp.arange(count) + 1.0, 0.5)
    assert told.tolist() == [10 * level + 0.5 * (level + 1) for level in range(count)]
    assert int(after.updates) == 5
    assert after.values["a"].shape == (count, 3)
    assert after.values["a"][-1].tolist() == [count - 1 + 0.5 * count] * 3
