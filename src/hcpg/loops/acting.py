"""From observations to executed actions: propose, see the scene, select. One jitted call."""

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.interfaces import Method, ReadScene, Valued
from hcpg.loops.once import once
from hcpg.loops.runs_axis import axes_of, over_runs
from hcpg.selection import Diagnostics, Selector, select
from hcpg.types import Scene


class Chosen(NamedTuple):
    """What to execute, and what the selector did, by name; nothing where none chose."""

    actions: Float[Array, "*runs E A"]
    seen: dict[str, Float[Array, "*runs"]]


class Considered(NamedTuple):
    """What to execute, and everything the selector knew and did, per environment."""

    actions: Float[Array, "*runs E A"]
    proposals: Float[Array, "*runs E K A"]
    scene: Scene
    diagnostics: Diagnostics


@once
def guided(method: Method, selector: Selector, read_scene: ReadScene) -> Callable[..., Chosen]:
    """A policy of the proposals: (state, observations [E, O], actor key, selector key) -> Chosen [E].

    Source: paper, algorithm 1, lines 1 to 7.
    """
    consider = considered(method, selector, read_scene)

    def every(state: Any, observations: Array, key: PRNGKeyArray, luck: PRNGKeyArray) -> Chosen:
        found = consider(state, observations, key, luck)
        return Chosen(found.actions, _summary(found.diagnostics))

    return every


@once
def considered(method: Method, selector: Selector, read_scene: ReadScene) -> Callable[..., Considered]:
    """The same policy, for those who want to see it think: it acts bit for bit like `guided`.

    Raises:
        TypeError: the selector ranks by value, and the method has no `value`.
    """
    if selector.needs_values and not isinstance(method, Valued):
        raise TypeError(f"the selector {selector.rule!r} needs a method with `value`, got {method!r}")

    def one(state: Any, observation: Array, key: PRNGKeyArray, luck: PRNGKeyArray) -> Considered:
        proposals = method.propose(state, observation, key, selector.candidates)
        extra = {}
        if selector.needs_noise:
            extra["noise"] = jax.random.uniform(luck, (selector.candidates,))
        if selector.needs_values:
            extra["values"] = cast("Valued", method).value(state, observation, proposals)
        scene = read_scene(observation)
        action, diagnostics = select(proposals, scene, selector, **extra)
        return Considered(action, proposals, scene, diagnostics)

    return _per_environment(one)


@once
def bare(method: Method) -> Callable[..., Chosen]:
    """The method's own evaluation action; no selector. Same signature as `guided`."""

    def one(state: Any, observation: Array, key: PRNGKeyArray, _: PRNGKeyArray) -> Array:
        return method.act(state, observation, key)

    def every(state: Any, observations: Array, key: PRNGKeyArray, luck: PRNGKeyArray) -> Chosen:
        return Chosen(_per_environment(one)(state, observations, key, luck), {})

    return every


@once
def compiled(policy: Callable[..., Any], state_type: type, runs: int) -> Callable[..., Any]:
    """The policy for R runs: (states, observations [R, E, O], actor keys [R], selector keys [R], tick).

    `tick` counts the policy's calls; it names the random numbers of this one.
    """

    def one_run(state: Any, observations: Array, key: Array, luck: Array, tick: Array) -> Any:
        return policy(state, observations, jax.random.fold_in(key, tick), jax.random.fold_in(luck, tick))

    return jax.jit(over_runs(one_run, runs, (axes_of(state_type), 0, 0, 0, None)))


@once
def appraised(method: Valued, state_type: type, runs: int) -> Callable[..., Float[Array, "R E"]]:
    """The pessimistic critic's values for R runs: (states, observations [R, E, O], actions [R, E, A])."""

    def one(state: Any, observation: Array, action: Array) -> Array:
        return method.value(state, observation, action[None])[0]

    every = jax.vmap(one, in_axes=(None, 0, 0))
    return jax.jit(over_runs(every, runs, (axes_of(state_type), 0, 0)))


@once
def warmup(runs: int, environments: int, action_size: int) -> Callable[..., Chosen]:
    """Uniform actions in [-1, 1] that bypass the selector: (keys [R], tick) -> Chosen."""

    def one_run(key: Array, tick: Array) -> Chosen:
        shape = (environments, action_size)
        return Chosen(jax.random.uniform(jax.random.fold_in(key, tick), shape, minval=-1, maxval=1), {})

    return jax.jit(over_runs(one_run, runs, (0, None)))


def _summary(diagnostics: Diagnostics) -> dict[str, Float[Array, ""]]:
    """What the selector did, averaged over a run's environments."""
    effective = 1 / jnp.square(diagnostics.weights).sum(axis=-1)
    shares = {
        "selector_phase": diagnostics.phase,
        "selector_effective_candidates": effective,
        "selector_spread": diagnostics.spread,
        "selector_blend_gap": diagnostics.blend_gap,
    }
    return {name: values.mean() for name, values in shares.items()}


def _per_environment(one: Callable[..., Any]) -> Callable[..., Any]:
    """`one`, written for one environment, for all of a run's; each has randomness of its own."""

    def every(state: Any, observations: Array, key: PRNGKeyArray, luck: PRNGKeyArray) -> Any:
        count = observations.shape[0]
        keys, lucks = jax.random.split(key, count), jax.random.split(luck, count)
        return jax.vmap(one, in_axes=(None, 0, 0, 0))(state, observations, keys, lucks)

    return every
