"""One sitting: start or take up runs in this process, train until the end or a stop, say how it ended."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path

from hcpg import presets, registry
from hcpg.loops.journal import Journal, Notify
from hcpg.loops.manifest import collect
from hcpg.loops.pool import Pool
from hcpg.loops.runs import RunFolder
from hcpg.loops.saving import Saver, restore
from hcpg.loops.training import Position, Trainer
from hcpg.presets import Settings

EXTENDABLE = ("budget.steps", "budget.evaluations")


def create_folders(settings: Settings, seeds: list[int], root: Path) -> list[RunFolder]:
    """A new run folder for every seed."""
    budget = settings.budget
    manifest = collect(
        effective_batch=budget.batch_size,
        update_ratio=budget.updates_per_step,
        evaluation_starts=range(budget.evaluation_episodes),
        training_selector=asdict(settings.selector),
        evaluation_selector=asdict(settings.evaluation_selector),
    )
    manifest["control"] = registry.task(settings.task).control
    address = {"task": settings.task, "preset": settings.preset, "manifest": manifest}
    config = settings.as_json()
    return [RunFolder.create(root, seed=seed, config=config, **address) for seed in seeds]


def seed_of(folder: RunFolder) -> int:
    """The seed a run was made with."""
    return int(folder.manifest()["run"]["seed"])


def extended(folder: RunFolder, steps: int | None) -> Settings:
    """A run's own settings, with another number of steps if one is given, evaluated as often per step."""
    config = folder.config()
    budget = config["budget"]
    if steps is not None:
        evaluations = max(1, round(budget["evaluations"] * steps / budget["steps"]))
        budget |= {"steps": steps, "evaluations": evaluations}
    return presets.from_json(config)


def sit(
    settings: Settings, folders: list[RunFolder], workers: int, notify: Notify, stop: Callable[[], bool]
) -> list[bool]:
    """Train the runs in `folders` together, from their checkpoints where they have any.

    Gives for each run whether it is sound (it did not diverge).

    Raises:
        RunFolderError: a folder is in use, or was made under other settings.
        WorkerError: an environment failed; the runs' state is saved.
    """
    seeds = [seed_of(folder) for folder in folders]
    with ExitStack() as stack:
        for folder in folders:
            folder.check_config(settings.as_json(), EXTENDABLE)
            stack.enter_context(folder.lock())
        facts = {"selector": settings.selector.rule, "adapter": settings.adapter}
        journal = Journal(folders, seeds, facts, notify)
        with _failure_noted(folders):
            trainer = Trainer(settings, seeds, journal, workers)
            pool = stack.enter_context(trainer.pool())
            position = _position(trainer, folders, pool)
            for folder in folders:
                folder.set_config(settings.as_json())
                folder.set_status("running", step=trainer.step(position))
            position = trainer.train(pool, position, Saver(trainer, folders), stop)
        done = position.tick >= trainer.schedule.ticks()
        journal.ended("finished" if done else "stopped", trainer.step(position))
        return journal.alive


def _position(trainer: Trainer, folders: list[RunFolder], pool: Pool) -> Position:
    """Where the runs go on: at their checkpoints, or at the beginning if they have none."""
    if any(any(folder.checkpoints.glob("step_*")) for folder in folders):
        return restore(trainer, folders, pool)
    for folder in folders:
        folder.rewind(0)  # a sitting that was killed before its first checkpoint may have left rows
    return trainer.fresh(pool)


@contextmanager
def _failure_noted(folders: list[RunFolder]) -> Iterator[None]:
    """Whatever goes wrong inside is written into the runs' status, and goes on its way."""
    try:
        yield
    except Exception as error:
        for folder in folders:
            folder.set_status("failed", error=f"{type(error).__name__}: {error}")
        raise
