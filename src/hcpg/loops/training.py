"""Train R runs of one configuration together: collect while learning, evaluate, save."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import numpy as jnp

from hcpg import registry
from hcpg.loops import acting, learning, memory, replay, streams
from hcpg.loops.batch_pool import open_pool
from hcpg.loops.episodes import Episodes
from hcpg.loops.evaluation import Evaluator
from hcpg.loops.journal import Journal
from hcpg.loops.pool import Arrival, Pool
from hcpg.loops.runs_axis import stack, take
from hcpg.loops.schedule import Schedule
from hcpg.loops.streams import Stream
from hcpg.presets import Settings
from hcpg.selection.arrays import namespace
from hcpg.types import Batch, Tensor

MEMORY_RETURNS_S = 10.0
"""How soon what compiling has left is handed back."""
_STACK, _INSERT = jax.jit(stack), jax.jit(replay.insert, donate_argnums=0)


class Position(NamedTuple):
    """Where a population is: all that changes while it trains."""

    tick: int
    """Steps made by each environment."""
    states: Any
    """The method's states, with the run axis."""
    replay: replay.Replay
    episodes: Episodes
    observations: Tensor
    """[R * E, O], what to act on next; on the accelerator where the simulator is."""
    finite: Any
    """[R], whether every number of a run's state is finite."""
    wall_s: float
    """Time spent so far, earlier sittings included."""


class Sent(NamedTuple):
    """What the environments were told."""

    actions: np.ndarray
    """[R * E, A]."""
    next_starts: np.ndarray
    """[R * E], where an environment goes on if its episode ends."""


class Trainer:
    """R runs (seeds) of one configuration on one pool of environments."""

    def __init__(self, settings: Settings, seeds: list[int], journal: Journal, workers: int) -> None:
        """Compile nothing and move nothing yet.

        Raises:
            BudgetError: the budget cannot be carried out.
            UnknownNameError: the task, method or adapter does not exist.
        """
        task = registry.task(settings.task)
        self.settings, self.seeds, self.journal, self.workers = settings, seeds, journal, workers
        self.spec = registry.suite(task.suite).spec(task)
        self._horizon = min(settings.budget.training_horizon or task.horizon, task.horizon)
        self.schedule = Schedule.of(settings.budget, self._horizon)
        self.method = registry.method(settings.method).METHOD(settings.learner, self.spec)
        if settings.adapter not in task.adapters:
            raise registry.UnknownNameError("adapter", settings.adapter, sorted(task.adapters))
        read_scene = task.adapters[settings.adapter]
        self.evaluator = Evaluator(settings, self.method, read_scene, seeds)
        self._keys = {each: jnp.stack([streams.key(seed, each) for seed in seeds]) for each in Stream}
        fresh = learning.initial(self.method)
        self._initial = _STACK([fresh(key) for key in self._keys[Stream.NETWORKS]])
        self._compile(read_scene)

    def _compile(self, read_scene: Any) -> None:
        runs, budget, state_type = len(self.seeds), self.settings.budget, type(self._initial)
        policy = acting.guided(self.method, self.settings.selector, read_scene)
        self._act = acting.compiled(policy, state_type, runs)
        self._warm = acting.warmup(runs, budget.environments, self.spec.action_size)
        updates = self.schedule.updates_per_tick
        self._learn = learning.compiled(self.method, state_type, runs, updates, budget.batch_size)

    def pool(self) -> Pool:
        """The training environments: E of each run, with the run's own start states."""
        seeds = np.repeat(self.seeds, self.settings.budget.environments)
        return open_pool(self.settings.task, seeds.tolist(), workers=self.workers, horizon=self._horizon)

    def empty(self) -> tuple[Any, replay.Replay]:
        """Fresh states and an empty replay, which also serve as templates for a checkpoint."""
        ever_inserted = self.schedule.ticks() * self.settings.budget.environments
        capacity = min(self.settings.budget.replay_capacity, ever_inserted)
        initial = jax.tree.map(jnp.copy, self._initial)  # the learner consumes what it is given
        return initial, replay.create(len(self.seeds), capacity, self.spec)

    def fresh(self, pool: Pool) -> Position:
        """The position at step 0."""
        states, ring = self.empty()
        starts = self._starts(np.zeros(pool.size, np.int64))
        return Position(0, states, ring, Episodes.begin(starts), pool.reset(starts), self._all_finite(), 0.0)

    def train(
        self, pool: Pool, position: Position, save: Callable[[Position], None], stop: Callable[[], bool]
    ) -> Position:
        """Go on from `position` to the end of the budget, or until `stop` says so or all runs diverged.

        `save` is called after every evaluation and before this returns or raises: a failing environment
        loses nothing that was learned.
        """
        began = time.monotonic() - position.wall_s
        returns = memory.Returns(MEMORY_RETURNS_S)
        self.journal.begin(self.step(position))
        try:
            self._evaluate(position, save)  # due here if the last sitting failed while it evaluated
            while position.tick < self.schedule.ticks() and any(self.journal.alive) and not stop():
                position, sent = self._send(pool, position)
                position = self._receive(pool, position, sent)
                position = position._replace(wall_s=time.monotonic() - began)
                if self.schedule.logs(position.tick):
                    updates = int(position.states.updates)
                    self.journal.row(self.step(position), updates, position.wall_s)
                    returns.hand_back()
                self._evaluate(position, save)
        finally:
            self.evaluator.close()
            save(position)
        return position

    def step(self, position: Position) -> int:
        """Environment steps of one run so far."""
        return position.tick * self.settings.budget.environments

    def _evaluate(self, position: Position, save: Callable[[Position], None]) -> None:
        step = self.step(position)
        if self.schedule.evaluates(position.tick) and not self.journal.has_evaluation(step):
            self.journal.evaluation(step, self.evaluator.evaluate(position.states, step, self.workers))
            save(position)

    def _send(self, pool: Pool, position: Position) -> tuple[Position, Sent]:
        """Hand out actions; while the environments step, learn from what came before."""
        sent = Sent(self._choose(position), self._starts(position.episodes.number + 1))
        pool.send(*sent)
        if not self.schedule.learns(position.tick):
            return position, sent
        keys = self._keys[Stream.REPLAY], self._keys[Stream.LEARNING]
        states, metrics, finite = self._learn(position.states, position.replay, *keys)
        self.journal.metrics(metrics)
        return position._replace(states=states, finite=finite), sent

    def _receive(self, pool: Pool, position: Position, sent: Sent) -> Position:
        """Take in what the environments answered."""
        arrival = pool.receive()
        tick = position.tick + 1
        self._note_divergence(tick, position, arrival)
        episodes, records = position.episodes.advance(arrival, sent.next_starts)
        self._note_episodes(tick, records)
        brought = Batch(
            position.observations,
            sent.actions,
            arrival.rewards,
            arrival.next_observations,
            arrival.terminated.astype(np.float32),
        )
        ring = _INSERT(position.replay, jax.tree.map(self._per_run, brought))
        return position._replace(tick=tick, replay=ring, episodes=episodes, observations=arrival.observations)

    def _choose(self, position: Position) -> np.ndarray:
        """Actions [R * E, A]."""
        if self.schedule.explores(position.tick):
            chosen = self._warm(self._keys[Stream.WARMUP], position.tick)
        else:
            keys = self._keys[Stream.ACTOR], self._keys[Stream.SELECTOR]
            observations = self._per_run(position.observations)
            chosen = self._act(position.states, observations, *keys, position.tick)
        self.journal.metrics(chosen.seen)
        actions = np.array(chosen.actions, np.float32).reshape(-1, self.spec.action_size)
        actions[~np.isfinite(actions).all(axis=1)] = 0.0  # a diverged run's; its simulators idle
        return actions

    def _note_divergence(self, tick: int, position: Position, arrival: Arrival) -> None:
        last = arrival.next_observations
        sound = {
            "reward": self._per_run(np.isfinite(arrival.rewards)).all(axis=1),
            "observation": np.asarray(self._per_run(namespace(last).isfinite(last)).all(axis=(1, 2))),
            "state": np.asarray(position.finite),
        }
        for run in range(len(self.seeds)):
            wrong = [quantity for quantity, fine in sound.items() if not fine[run]]
            if wrong and self.journal.alive[run]:
                leaf = learning.first_bad_leaf(take(position.states, run))
                quantity = leaf if wrong[0] == "state" else wrong[0]
                self.journal.diverged(run, tick * self.settings.budget.environments, quantity)

    def _note_episodes(self, tick: int, records: list[dict[str, Any]]) -> None:
        environments = self.settings.budget.environments
        for run in range(len(self.seeds)):
            own = range(run * environments, (run + 1) * environments)
            mine = [
                record | {"environment": record["environment"] - own[0]}
                for record in records
                if record["environment"] in own
            ]
            self.journal.episodes(tick * environments, run, mine)

    def _all_finite(self) -> np.ndarray:
        return np.ones(len(self.seeds), bool)

    def _starts(self, numbers: np.ndarray) -> np.ndarray:
        """The start state of every environment's episode with that number."""
        per_run = zip(self.seeds, self._per_run(numbers), strict=True)
        return np.concatenate([streams.start_states(seed, of) for seed, of in per_run])

    def _per_run(self, rows: Tensor) -> Tensor:
        return rows.reshape(len(self.seeds), self.settings.budget.environments, *rows.shape[1:])
