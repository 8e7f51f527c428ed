"""A population's position written to and read from its runs' checkpoints."""

from pathlib import Path
from typing import Any

import numpy as np
from jax import numpy as jnp

from hcpg.loops import checkpoints, replay
from hcpg.loops.checkpoints import CheckpointError
from hcpg.loops.episodes import Episodes
from hcpg.loops.pool import Pool
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import stack, take
from hcpg.loops.training import Position, Trainer
from hcpg.types import Tensor


class Saver:
    """Writes one checkpoint per living run whenever it is called."""

    def __init__(self, trainer: Trainer, folders: list[RunFolder]) -> None:
        self._trainer, self._folders = trainer, folders
        self._saved_tick = -1

    def __call__(self, position: Position) -> None:
        """Save every run that has not diverged; a diverged one keeps its last sound checkpoint."""
        if position.tick == self._saved_tick:
            return
        for run, folder in enumerate(self._folders):
            if self._trainer.journal.alive[run]:
                self._save(position, run, folder)
        self._saved_tick = position.tick

    def _save(self, position: Position, run: int, folder: RunFolder) -> None:
        environments = self._trainer.settings.budget.environments
        own = slice(run * environments, (run + 1) * environments)
        trees = {
            "state": take(position.states, run),
            "replay": replay.filled_part(position.replay, run),
            "observations": {"next": np.asarray(position.observations[own])},
        }
        facts = {
            "tick": position.tick,
            "inserted": int(position.replay.inserted),
            "episodes": Episodes(*(each[own] for each in position.episodes)).as_json(),
            "wall_s": position.wall_s,
        }
        checkpoints.save(folder.checkpoints, self._trainer.step(position), trees, facts)


def restore(trainer: Trainer, folders: list[RunFolder], pool: Pool) -> Position:
    """The position of the newest checkpoint that all runs have; rows written after it are dropped.

    Every simulator is brought back by replaying the actions of its running episode.

    Raises:
        CheckpointError: there is no sound checkpoint, the runs have none in common, or a simulator
            does not come back to the observation it was left at.
    """
    paths = _common(folders)
    loaded = [_load(trainer, path) for path in paths]
    facts = loaded[0][2]
    _, memory = trainer.empty()
    states = stack([trees["state"] for trees, _, _ in loaded])
    parts = [part for _, part, _ in loaded]
    episodes = _joined([each["episodes"] for _, _, each in loaded])
    observations = np.concatenate([np.asarray(trees["observations"]["next"]) for trees, _, _ in loaded])
    observations = _bring_back(trainer, pool, episodes, parts, facts["inserted"], observations)
    for folder in folders:
        folder.rewind(checkpoints.step_of(paths[0]))
    return Position(
        facts["tick"],
        states,
        replay.refill(memory, parts, facts["inserted"]),
        episodes,
        observations,
        np.ones(len(folders), bool),
        facts["wall_s"],
    )


def _common(folders: list[RunFolder]) -> list[Path]:
    """The newest checkpoint at one and the same step: a kill may fall between two runs' saves."""
    newest = [checkpoints.latest(folder.checkpoints) for folder in folders]
    for folder, path in zip(folders, newest, strict=True):
        if path is None:
            raise CheckpointError(f"run {folder.path} has no checkpoint to resume from; start a new run.")
    step = min(checkpoints.step_of(path) for path in newest if path is not None)
    paths = [checkpoints.latest(folder.checkpoints, not_after=step) for folder in folders]
    found = [path for path in paths if path is not None and checkpoints.step_of(path) == step]
    if len(found) < len(folders):
        raise CheckpointError(f"not all runs have a checkpoint at step {step}; resume them one by one.")
    return found


def load_state(folder: RunFolder, template: Any, step: int | None = None) -> tuple[Any, int]:
    """The method's state of a run's newest checkpoint (or the one at `step`), and its step.

    Raises:
        CheckpointError: there is no such checkpoint.
    """
    path = checkpoints.latest(folder.checkpoints, not_after=step)
    if path is None or step not in (None, checkpoints.step_of(path)):
        kept = sorted(each.name for each in folder.checkpoints.glob("step_*"))
        wanted = "checkpoint" if step is None else f"checkpoint at step {step}"
        raise CheckpointError(f"run {folder.path} has no {wanted}. There are: {', '.join(kept) or 'none'}.")
    trees, _ = checkpoints.load(path, {"state": template})
    return trees["state"], checkpoints.step_of(path)


def _load(trainer: Trainer, path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray], dict[str, Any]]:
    environments, size = trainer.settings.budget.environments, trainer.spec.observation_size
    templates = {
        "state": take(trainer.empty()[0], 0),
        "observations": {"next": np.zeros((environments, size), np.float32)},
    }
    trees, facts = checkpoints.load(path, templates)
    raw = checkpoints.load_raw(path, "replay")
    part = {name.strip("[]'"): rows for name, rows in raw.items()}
    return trees, part, facts


def _joined(lists: list[dict[str, list]]) -> Episodes:
    every = [Episodes.from_json(each) for each in lists]
    return Episodes(*(np.concatenate(fields) for fields in zip(*every, strict=True)))


def _bring_back(
    trainer: Trainer,
    pool: Pool,
    episodes: Episodes,
    parts: list[dict[str, np.ndarray]],
    inserted: int,
    observations: np.ndarray,
) -> Tensor:
    """What to act on next: the stored observations, or where the simulator came to if it is not exact."""
    environments = trainer.settings.budget.environments
    ages = episodes.length.reshape(len(parts), environments)
    pairs = zip(parts, ages, strict=True)
    actions = [each for part, age in pairs for each in replay.last_actions(part, inserted, environments, age)]
    back = pool.restore(episodes.start, actions)
    if pool.exact and not np.array_equal(back, observations):
        gap = float(jnp.abs(back - observations).max())
        raise CheckpointError(
            f"the simulator does not come back to where the checkpoint left it (largest difference {gap:g}). "
            "The simulator's or NumPy's version differs from the run's manifest: install those versions."
        )
    return back
