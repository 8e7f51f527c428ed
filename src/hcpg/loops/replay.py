"""A ring of transitions per run, kept on the device and sampled inside the learner's scan."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import numpy as jnp
from jaxtyping import Array, Int, Key, PRNGKeyArray

from hcpg.loops.runs_axis import over_runs
from hcpg.types import Batch, Sampling, Spec

Draw = Callable[[Any, Key[Array, " R"]], Batch]
"""(what is learned from, keys [R]) -> a batch [R, B, ...]."""


class Replay(NamedTuple):
    """The newest `capacity` transitions of each run; one insertion brings E of them per run."""

    transitions: Batch
    """Arrays [R, capacity, ...]."""
    inserted: Int[Array, ""]
    """Transitions ever inserted per run; the next goes to this index modulo the capacity."""


def create(runs: int, capacity: int, spec: Spec) -> Replay:
    """An empty ring."""
    observations = jnp.zeros((runs, capacity, spec.observation_size))
    actions = jnp.zeros((runs, capacity, spec.action_size))
    numbers = jnp.zeros((runs, capacity))
    transitions = Batch(observations, actions, numbers, jnp.copy(observations), jnp.copy(numbers))
    return Replay(transitions, jnp.zeros((), jnp.int32))


def insert(replay: Replay, arrivals: Batch) -> Replay:
    """The ring with `arrivals` [R, E, ...] in place of the oldest E transitions of each run.

    The capacity must be a multiple of E: an insertion never wraps around.
    """
    capacity, brought = replay.transitions.rewards.shape[1], arrivals.rewards.shape[1]
    position = replay.inserted % capacity

    def write(ring: Array, rows: Array) -> Array:
        return jax.lax.dynamic_update_slice_in_dim(ring, rows, position, axis=1)

    transitions = jax.tree.map(write, replay.transitions, arrivals)
    return Replay(transitions, replay.inserted + brought)


def sample(
    transitions: Batch, inserted: Int[Array, ""], key: PRNGKeyArray, batch_size: int, sampling: Sampling
) -> Batch:
    """`batch_size` transitions of one run, with replacement; those from the newest alone come last.

    A row drawn twice leaves the mean gradient as it is. It is rare, too: of 51 rows from the newest 2048,
    0.6 repeat another one on average; of the other 205, 4.1 in a ring of 5000 and 0.1 in one of 200000.
    """
    capacity = transitions.rewards.shape[0]
    filled = jnp.minimum(inserted, capacity)
    recent = round(sampling.recent_share * batch_size)
    if recent == 0:
        rows = jax.random.randint(key, (batch_size,), 0, filled)
    else:
        of_all, of_recent = jax.random.split(key)
        window = jnp.minimum(filled, sampling.recent_window)
        ages = jax.random.randint(of_recent, (recent,), 1, window + 1)
        uniform = jax.random.randint(of_all, (batch_size - recent,), 0, filled)
        rows = jnp.concatenate([uniform, (inserted - ages) % capacity])
    return jax.tree.map(lambda ring: ring[rows], transitions)


def drawing(runs: int, batch_size: int, sampling: Sampling) -> Draw:
    """Batches of one ring, for all runs."""
    one = partial(sample, batch_size=batch_size, sampling=sampling)
    every = over_runs(one, runs, (0, None, 0))
    return lambda replay, keys: every(replay.transitions, replay.inserted, keys)


class Halves(NamedTuple):
    """Two rings that a batch takes half of each from."""

    demonstrations: Replay
    online: Replay


def drawing_halves(runs: int, batch_size: int, sampling: Sampling) -> Draw:
    """Batches of `Halves`: the demonstrations' rows come first."""
    sizes = (batch_size // 2, batch_size - batch_size // 2)
    draws = [drawing(runs, size, sampling) for size in sizes]

    def draw(halves: Halves, keys: Key[Array, " R"]) -> Batch:
        both = jax.vmap(jax.random.split)(keys)
        parts = [
            each(ring, both[:, place]) for place, (each, ring) in enumerate(zip(draws, halves, strict=True))
        ]
        return jax.tree.map(lambda *rows: jnp.concatenate(rows, axis=1), *parts)

    return draw


def filled_part(replay: Replay, run: int) -> dict[str, np.ndarray]:
    """One run's transitions as NumPy arrays, in ring order, without the part never written."""
    filled = min(int(replay.inserted), replay.transitions.rewards.shape[1])
    rings = replay.transitions._asdict()
    return {name: np.asarray(ring[run])[:filled] for name, ring in rings.items()}


def refill(replay: Replay, parts: list[dict[str, np.ndarray]], inserted: int) -> Replay:
    """The ring as it was when `filled_part` read each run's share."""
    rings = {
        name: ring.at[:, : len(parts[0][name])].set(np.stack([part[name] for part in parts]))
        for name, ring in replay.transitions._asdict().items()
    }
    return Replay(Batch(**rings), jnp.asarray(inserted, jnp.int32))


def last_actions(part: dict[str, np.ndarray], inserted: int, environments: int, ages: np.ndarray) -> list:
    """Each environment's actions since its episode began, `ages[e]` of them, oldest first.

    `part` comes from `filled_part`; insertions were E rows each, one per environment.
    """
    actions = part["actions"]
    newest = inserted // environments
    steps = [np.arange(newest - age, newest) for age in ages]
    rows = [(each * environments + index) % len(actions) for index, each in enumerate(steps)]
    return [actions[each] for each in rows]
