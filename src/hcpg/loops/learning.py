"""Updates of all runs in one jitted call: sample, learn, repeat; buffers are donated."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from hcpg.interfaces import Method
from hcpg.loops.once import once
from hcpg.loops.replay import Draw, drawing
from hcpg.loops.runs_axis import axes_of, over_runs

Learn = Callable[..., tuple[Any, dict[str, Float[Array, " R"]], Bool[Array, " R"]]]


@once
def initial(method: Method) -> Callable[..., Any]:
    """The method's fresh state from a key, compiled as one program instead of a hundred small ones."""
    return jax.jit(method.init)


@once
def compiled(
    method: Method, state_type: type, runs: int, updates: int, batch_size: int, draw: Draw | None = None
) -> Learn:
    """`updates` learning steps: (states, replay, sampling keys [R], learning keys [R]).

    Batches come from `draw`; None draws them from a `Replay` as the method wants them.

    Gives the states, the metrics and whether every number of a run's state is still finite. Metrics are
    means over the updates that report them: what a delayed update leaves out is NaN, and is NaN in the
    mean only if no update reported it.
    """
    axes = axes_of(state_type)
    update = over_runs(method.update, runs, (axes, 0, 0), (axes, 0))
    finite = over_runs(is_finite, runs, (axes,))
    batch_of = draw or drawing(runs, batch_size, method.sampling)
    fold = jax.vmap(jax.random.fold_in, in_axes=(0, None))

    def learn(states: Any, replay: Any, sampling: Key[Array, " R"], learning: Key[Array, " R"]) -> tuple:
        def body(states: Any, _: None) -> tuple[Any, dict[str, Array]]:
            batch = batch_of(replay, fold(sampling, states.updates))
            return update(states, batch, fold(learning, states.updates))

        states, history = jax.lax.scan(body, states, length=updates)
        metrics = {name: jnp.nanmean(values, axis=0) for name, values in history.items()}
        return states, metrics, finite(states)

    return jax.jit(learn, donate_argnums=0)


def is_finite(state: Any) -> Bool[Array, ""]:
    """Whether every floating-point number of a state is finite (a sum shows one that is not)."""
    numbers = [leaf.sum() for leaf in jax.tree.leaves(eqx.filter(state, eqx.is_inexact_array))]
    return jnp.isfinite(jnp.stack(numbers)).all()


def first_bad_leaf(state: Any) -> str:
    """Where a state holds a number that is not finite, for the report of a diverged run."""
    for path, leaf in jax.tree_util.tree_leaves_with_path(eqx.filter(state, eqx.is_inexact_array)):
        if not bool(jnp.isfinite(leaf).all()):
            return "state" + jax.tree_util.keystr(path)
    return "state"
