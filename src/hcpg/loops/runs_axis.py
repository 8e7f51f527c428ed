"""The leading run axis R: several seeds of one configuration, learned together.

Every leaf of a method's state gets the axis, but for the count of updates, which all runs share.
With one run the axis is taken off and put back, since mapping over one costs a CPU dearly.
"""

from collections.abc import Callable
from typing import Any

import jax
from jax import numpy as jnp

State = Any


def axes_of(state_type: type) -> State:
    """Which axis of each field of a state holds the runs: 0, and None for the shared `updates`."""
    return state_type(**{name: None if name == "updates" else 0 for name in state_type._fields})


def stack(states: list[State]) -> State:
    """Single states put side by side."""
    return jax.tree.map(lambda *each: jnp.stack(each), *states)._replace(updates=states[0].updates)


def take(states: State, run: int) -> State:
    """The state of one run, as the method knows it."""
    one = jax.tree.map(lambda leaf: leaf[run], states._replace(updates=None))
    return one._replace(updates=states.updates)


def over_runs(function: Callable, count: int, axes: tuple, out_axes: Any = 0) -> Callable:
    """`function`, written for one run, for all `count` of them.

    `axes` says for each argument where its runs are, like `jax.vmap`'s `in_axes`.
    """
    if count > 1:
        return jax.vmap(function, in_axes=axes, out_axes=out_axes)

    def alone(*arguments: Any) -> Any:
        results = function(*(_walk(_off, axis, each) for axis, each in zip(axes, arguments, strict=True)))
        return _walk(_on, out_axes, results)

    return alone


def _walk(change: Callable, axes: Any, tree: Any) -> Any:
    spread = jax.tree.broadcast(axes, tree, is_leaf=lambda axis: axis is None)
    return jax.tree.map(change, tree, spread)


def _off(leaf: Any, axis: int | None) -> Any:
    return leaf if axis is None else leaf[0]


def _on(leaf: Any, axis: int | None) -> Any:
    return leaf if axis is None else leaf[None]
