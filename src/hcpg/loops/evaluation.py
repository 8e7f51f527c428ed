"""The evaluation protocol: fixed start states, once with the selector and once bare.

Where the selector has one proposal, there is nothing to choose: such runs are evaluated once, by the method's
own evaluation action.
"""

from collections.abc import Callable, Iterable
from typing import Any

import jax
import numpy as np

from hcpg.interfaces import Method, ReadScene, Valued
from hcpg.loops import acting
from hcpg.loops.batch_pool import open_pool
from hcpg.loops.episodes import Episodes
from hcpg.loops.pool import Pool
from hcpg.loops.streams import EVALUATION_SEED, Stream, key
from hcpg.presets import Settings
from hcpg.types import Tensor

BARE = "bare"
SIMULTANEOUS_EPISODES = 10
"""Per run. Random numbers are drawn for all of them at once: another number would bring other episodes."""


class Evaluator:
    """Evaluates R runs on one list of start states, the same for every run, method and time."""

    def __init__(self, settings: Settings, method: Method, read_scene: ReadScene, seeds: list[int]) -> None:
        self.episodes = settings.budget.evaluation_episodes
        self._settings, self._method, self._seeds = settings, method, seeds
        selector = settings.evaluation_selector
        guided = {} if selector.alone else {selector.rule: acting.guided(method, selector, read_scene)}
        self._policies = guided | {BARE: acting.bare(method)}
        self._compiled: dict[str, Callable[..., acting.Chosen]] = {}
        self._pool: Pool | None = None
        self._slots = min(self.episodes, SIMULTANEOUS_EPISODES)

    def start_states(self) -> dict[str, Any]:
        """The list of start states, for the manifest."""
        return {"set_seed": EVALUATION_SEED, "starts": list(range(self.episodes))}

    def evaluate(
        self, states: Any, step: int, workers: int, names: Iterable[str] | None = None
    ) -> list[list[dict[str, Any]]]:
        """For each run, a row per episode: all with the selector, then all bare (or only `names`).

        A row has what the critic expected of the episode's first action (`value`; null without a critic) and
        what came of it (`discounted_return`, without any bonus for entropy): their difference tells how far
        the critic overestimates.
        """
        if self._pool is None:
            seeds = [EVALUATION_SEED] * (self._slots * len(self._seeds))
            self._pool = open_pool(self._settings.task, seeds, workers=workers)
        rows: list[list[dict[str, Any]]] = [[] for _ in self._seeds]
        for name in self._policies if names is None else names:
            for first in range(0, self.episodes, self._slots):
                starts = np.arange(first, min(first + self._slots, self.episodes))
                for run, records in enumerate(self._wave(name, states, step, starts)):
                    facts = {"step": step, "phase": "evaluation", "selector": name}
                    rows[run] += [{**facts, "adapter": self._settings.adapter, **each} for each in records]
        return rows

    def close(self) -> None:
        """Stop the evaluation's simulators."""
        if self._pool is not None:
            self._pool.close()

    def _wave(self, name: str, states: Any, step: int, starts: np.ndarray) -> list[list[dict[str, Any]]]:
        """One episode from each start state, all runs side by side; records in order of the starts."""
        pool, runs = self._pool, len(self._seeds)
        assert pool is not None
        policy = self._policy(name, states)
        padded = np.resize(starts, self._slots)
        every = np.tile(padded, runs)
        observations, episodes = pool.reset(every), Episodes.begin(every)
        keys, lucks = self._keys(step, int(starts[0]))
        records: dict[int, dict[str, Any]] = {}
        values, discounted = np.empty(0), np.zeros(pool.size)
        tick = 0
        while len(records) < pool.size:
            shaped = observations.reshape(runs, self._slots, -1)
            actions = np.nan_to_num(np.asarray(policy(states, shaped, keys, lucks, tick).actions))
            pool.send(actions.reshape(pool.size, -1), every)
            if tick == 0:
                values = self._values(states, shaped, actions)
            arrival = pool.receive()
            discounted += self._settings.learner.discount**tick * arrival.rewards
            episodes, ended = episodes.advance(arrival, every)
            for record in ended:
                place = record["environment"]
                worth = {"value": float(values[place]), "discounted_return": float(discounted[place])}
                records.setdefault(place, record | worth)
            observations, tick = arrival.observations, tick + 1
        wanted = [range(run * self._slots, run * self._slots + len(starts)) for run in range(runs)]
        return [[records[i] | {"environment": i - indices[0]} for i in indices] for indices in wanted]

    def _values(self, states: Any, observations: Tensor, actions: np.ndarray) -> np.ndarray:
        """What the critic expects of each episode's first action, [R * slots]; NaN without a critic."""
        if not isinstance(self._method, Valued):
            return np.full(actions.shape[0] * actions.shape[1], np.nan)
        appraise = acting.appraised(self._method, type(states), len(self._seeds))
        return np.asarray(appraise(states, observations, actions)).reshape(-1)

    def _policy(self, name: str, states: Any) -> Callable[..., acting.Chosen]:
        if name not in self._compiled:
            runs = len(self._seeds)
            self._compiled[name] = acting.compiled(self._policies[name], type(states), runs)
        return self._compiled[name]

    def _keys(self, step: int, first: int) -> tuple[jax.Array, jax.Array]:
        roots = [key(seed, Stream.EVALUATION) for seed in self._seeds]
        at = [jax.random.fold_in(jax.random.fold_in(root, step), first) for root in roots]
        both = jax.vmap(jax.random.split)(jax.numpy.stack(at))
        return both[:, 0], both[:, 1]
