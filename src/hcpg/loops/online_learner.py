"""The learner of an arm: takes in one episode after the other, half of every batch from demonstrations.

As many updates follow an episode as its actions have earned, whoever selected them; then the checkpoint is
written that the next episode acts by. All that it knows is in that checkpoint.
"""

import time
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import numpy as jnp

from hcpg import presets, registry
from hcpg.loops import checkpoints, learning, replay
from hcpg.loops.control.experience import Experience
from hcpg.loops.demonstrations import Demonstrations
from hcpg.loops.journal import Journal
from hcpg.loops.replay import Halves
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import stack, take
from hcpg.loops.sitting import seed_of
from hcpg.loops.streams import Stream, key
from hcpg.types import Batch, Float, Spec

CANDIDATES, ASKED = 4, 64
"""How many proposals at how many demonstrated observations tell the actor's own spread."""


class DivergedError(RuntimeError):
    """Numbers that are not finite any more; the message says where."""


class Progress(NamedTuple):
    """Where a run is, between two episodes."""

    executed: int
    """Actions charged to the budget."""
    episodes: int
    """The number of the next episode."""
    updates: int
    wall_s: float
    """Time spent learning."""


def begin(folder: RunFolder, state: Any, spec: Spec) -> None:
    """Write the checkpoint at step 0: the initial policy, and nothing seen yet."""
    checkpoints.save(folder.checkpoints, 0, {"state": state, "online": _nothing(spec)}, _facts(0, 0, 0.0))


def progress_of(folder: RunFolder) -> Progress:
    """Where the run is by its newest checkpoint.

    Raises:
        CheckpointError: there is none.
    """
    path = _newest(folder)
    _, facts = checkpoints.load(path, {})
    return Progress(**facts["progress"])


class OnlineLearner:
    """One run's learner, as it was at its newest checkpoint."""

    def __init__(self, folder: RunFolder, shown: Demonstrations) -> None:
        """Take up the run; rows written after the checkpoint are dropped.

        Raises:
            CheckpointError: the run has no sound checkpoint.
        """
        settings = presets.from_json(folder.config())
        task = registry.task(settings.task)
        spec = registry.suite(task.suite).spec(task)
        method = registry.method(settings.method).METHOD(settings.learner, spec)
        seed, budget = seed_of(folder), settings.budget
        template = learning.initial(method)(key(seed, Stream.NETWORKS))
        path = _newest(folder)
        trees, facts = checkpoints.load(path, {"state": template})
        self._online = {
            name.strip("[]'"): rows for name, rows in checkpoints.load_raw(path, "online").items()
        }
        self.progress = Progress(**facts["progress"])
        folder.rewind(self.progress.executed)
        self._folder, self._states = folder, stack([trees["state"]])
        self._per_action = round(budget.updates_per_step)
        self._rings = Halves(
            _ring(shown.batch._asdict(), spec), replay.create(1, budget.replay_capacity, spec)
        )
        draw = replay.drawing_halves(1, budget.batch_size, method.sampling)
        sizes = (1, self._per_action, budget.batch_size)
        self._learn = learning.compiled(method, type(template), *sizes, draw)
        self._keys = [key(seed, stream)[None] for stream in (Stream.REPLAY, Stream.LEARNING)]
        self._spread = _spread_of(method, shown.batch.observations, key(seed, Stream.ACTOR))
        selector = {"selector": settings.selector.rule, "adapter": settings.adapter}
        self.told: list[dict[str, Any]] = []
        """Rows of metrics written by this sitting."""
        self._journal = Journal([folder], [seed], selector, lambda event: self.told.append(event.facts))
        self._journal.begin(self.progress.executed)

    def take_in(self, episode: Experience) -> Progress:
        """Learn from one more episode, write everything down, and give where the run is now.

        Raises:
            DivergedError: a number of the state is not finite any more; the last checkpoint stays.
        """
        began = time.monotonic()
        before = self.progress
        self._online = {
            name: np.concatenate([rows, getattr(episode.batch, name)]) for name, rows in self._online.items()
        }
        executed = before.executed + episode.actions
        updates = self._update(executed * self._per_action)
        wall_s = before.wall_s + time.monotonic() - began
        self.progress = Progress(executed, episode.number + 1, updates, wall_s)
        self._write(episode)
        return self.progress

    def _update(self, due: int) -> int:
        """Make updates until `due` have been made in all; none while there is nothing to learn from."""
        made, rows = int(self._states.updates), len(self._online["rewards"])
        if rows == 0:
            return made
        rings = self._rings._replace(online=replay.refill(self._rings.online, [self._online], rows))
        while made < due:
            self._states, metrics, finite = self._learn(self._states, rings, *self._keys)
            self._journal.metrics(metrics)
            made += self._per_action
            if not bool(finite.all()):
                leaf = learning.first_bad_leaf(take(self._states, 0))
                self._journal.diverged(0, self.progress.executed, leaf)
                raise DivergedError(f"{leaf} is not finite any more after {made} updates; start a new run")
        return made

    def _write(self, episode: Experience) -> None:
        """Rows first, then the checkpoint: rows past a checkpoint are dropped, missing ones are lost."""
        state, progress = take(self._states, 0), self.progress
        seen = {**episode.seen, "actor_spread": self._spread(state)}
        self._journal.metrics({name: np.asarray([value]) for name, value in seen.items()})
        self._journal.episodes(progress.executed, 0, [_record(episode)])
        self._journal.row(progress.executed, progress.updates, progress.wall_s)
        trees = {"state": state, "online": self._online}
        facts = _facts(progress.executed, progress.episodes, progress.wall_s, progress.updates)
        checkpoints.save(self._folder.checkpoints, progress.executed, trees, facts)


def _record(episode: Experience) -> dict[str, Any]:
    return {
        "environment": 0,
        "start": episode.start,
        "success_once": episode.success,
        "success_at_end": episode.success,
        "steps_to_success": episode.actions if episode.success else -1,
        "return": float(episode.batch.rewards.sum()),
        "length": episode.actions,
        "ended": episode.ended,
    }


def _facts(executed: int, episodes: int, wall_s: float, updates: int = 0) -> dict[str, Any]:
    return {"progress": Progress(executed, episodes, updates, wall_s)._asdict()}


def _newest(folder: RunFolder) -> Any:
    path = checkpoints.latest(folder.checkpoints)
    if path is None:
        raise checkpoints.CheckpointError(f"run {folder.path} has no checkpoint; start a new run.")
    return path


def _nothing(spec: Spec) -> dict[str, Float[np.ndarray, "..."]]:
    sizes = (spec.observation_size, spec.action_size, None, spec.observation_size, None)
    shapes = [(0,) if size is None else (0, size) for size in sizes]
    return {name: np.zeros(shape, np.float32) for name, shape in zip(Batch._fields, shapes, strict=True)}


def _ring(part: dict[str, np.ndarray], spec: Spec) -> replay.Replay:
    rows = len(part["rewards"])
    return replay.refill(replay.create(1, rows, spec), [part], rows)


def _spread_of(method: Any, observations: Float[np.ndarray, "T O"], root: jax.Array) -> Any:
    """What measures the actor's spread: root mean square distance of proposals to their mean."""
    places = np.linspace(0, len(observations) - 1, ASKED).round().astype(int)
    asked, keys = jnp.asarray(observations[places]), jax.random.split(root, ASKED)

    @jax.jit
    def spread(state: Any) -> jax.Array:
        propose = jax.vmap(lambda each, own: method.propose(state, each, own, CANDIDATES))
        return jnp.sqrt(propose(asked, keys).var(axis=1).sum(axis=-1).mean())

    return lambda state: float(spread(state))
