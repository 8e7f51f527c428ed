"""Gradient steps and moving averages of parameters, the same for every network and every method."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, PyTree


def rest(optimizer: optax.GradientTransformation, parameters: PyTree) -> PyTree:
    """The optimizer's state before the first step."""
    return optimizer.init(parameters)


def descend(
    optimizer: optax.GradientTransformation, gradient: PyTree, optimizer_state: PyTree, parameters: PyTree
) -> tuple[PyTree, PyTree]:
    """The parameters after one step of the optimizer, and the optimizer's state after it."""
    step, optimizer_state = optimizer.update(gradient, optimizer_state)
    return optax.apply_updates(parameters, step), optimizer_state


def follow(target: PyTree, online: PyTree, rate: float) -> PyTree:
    """`target` moved towards `online`: (1 - rate) * target + rate * online."""
    return jax.tree.map(lambda old, new: (1 - rate) * old + rate * new, target, online)


def count_update(
    state: Any, period: int, improve: Callable[[Any], tuple[Any, dict[str, Array]]], reported: Sequence[str]
) -> tuple[Any, dict[str, Array]]:
    """The state with this update counted, and improved if it is a `period`-th one.

    `improve` gives the state and the metrics named in `reported`; where it does not run, those are NaN.
    """
    state = state._replace(updates=state.updates + 1)
    absent = dict.fromkeys(reported, jnp.float32(jnp.nan))
    return jax.lax.cond(state.updates % period == 0, improve, lambda same: (same, absent), state)
