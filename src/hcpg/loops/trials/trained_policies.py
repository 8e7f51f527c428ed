"""A trained run as a contender: the checkpoint by its digest, and its policy at 30 Hz."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax import numpy as jnp

from hcpg import registry
from hcpg.loops import checkpoints
from hcpg.loops.control.choosing import Chooser, Propose
from hcpg.loops.evaluation import BARE
from hcpg.loops.runs_axis import take
from hcpg.loops.streams import Stream, key
from hcpg.loops.trained import Choice, Trained, load
from hcpg.loops.trials.contenders import ALONE, Contender
from hcpg.loops.trials.plan import PlanError
from hcpg.selection import Selector
from hcpg.types import Float


def trained(path: Path, choice: Choice, task: str, seed: int) -> Contender:
    """The run, or the checkpoint, at `path`, acting as in its evaluation; compiled before it is given.

    Raises:
        PlanError: it learned another task.
        RunFolderError: there is no run.
        CheckpointError: it has no such checkpoint, or a damaged one.
        UnknownNameError: no rule or adapter has the name.
        UnservedSelectorError: its selector needs a critic.
    """
    found = load(path, choice)
    if found.settings.task != task:
        raise PlanError(f"the run {path} learned {found.settings.task}, not {task}; name a run of that task")
    selector = ALONE if found.name == BARE else found.settings.evaluation_selector
    spec = registry.suite(registry.task(task).suite).spec(registry.task(task))
    propose = _proposing(found, seed)
    for count in {1, selector.candidates}:
        propose(0)(np.zeros(spec.observation_size, np.float32), count, 0)

    def chooser(start: int) -> Chooser:
        return Chooser(propose(start), selector, found.read_scene, spec.action_size, seed + start)

    return Contender(_facts(found, selector), chooser)


def _facts(found: Trained, selector: Selector) -> dict[str, Any]:
    path = checkpoints.latest(found.folder.checkpoints, not_after=found.step)
    assert path is not None  # it was loaded
    return {
        "source": "checkpoint",
        "sha256": hashlib.sha256((path / "facts.json").read_bytes()).hexdigest(),
        "step": found.step,
        "preset": found.settings.preset,
        "method": found.settings.method,
        "learner": asdict(found.settings.learner),
        "seed": found.seed,
        "acts": found.name,
        "selector": asdict(selector),
        "adapter": found.settings.adapter,
    }


def _proposing(found: Trained, seed: int) -> Callable[[int], Propose]:
    """From a start state to the policy whose draws it names."""
    method, state = found.method, take(found.states, 0)
    root = jax.random.fold_in(key(found.seed, Stream.EVALUATION), seed)

    def sample(state: Any, observation: Any, start: Any, draw: Any, count: int) -> Any:
        luck = jax.random.fold_in(jax.random.fold_in(root, start), draw)
        if found.name == BARE:
            return method.act(state, observation, luck)[None]
        return method.propose(state, observation, luck, count)

    compiled = jax.jit(sample, static_argnums=4)

    def of(start: int) -> Propose:
        def propose(observation: Float[np.ndarray, " O"], count: int, draw: int) -> Float[np.ndarray, "K A"]:
            found = compiled(state, jnp.asarray(observation, jnp.float32), start, draw, count)
            return np.asarray(found)

        return propose

    return of
