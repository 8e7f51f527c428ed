"""A trained run written out for a robot's computer, where no JAX is: numbers, facts, model card."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jax.tree_util import keystr, tree_leaves_with_path

import hcpg
from hcpg import registry
from hcpg.interfaces import Method
from hcpg.loops import checkpoints
from hcpg.loops.control.deployed import Policy
from hcpg.loops.control.deployed import parcel as parcels
from hcpg.loops.evaluation import BARE
from hcpg.loops.runs_axis import take
from hcpg.loops.trained import Trained
from hcpg.networks.batch_renorm import EPSILON
from hcpg.networks.decoder_actor import DecoderActor
from hcpg.networks.flow import FlowActor, Noise
from hcpg.networks.gated_actor import GatedActor
from hcpg.networks.gaussian import LOG_DEVIATION_RANGE, GaussianActor
from hcpg.networks.plain_actor import PlainActor
from hcpg.report.model_card import Evaluation, last_evaluations, model_card
from hcpg.report.records import load_run
from hcpg.selection import Selector
from hcpg.types import Float, Tensor

KINDS: Mapping[type, str] = {
    GatedActor: "gated",
    DecoderActor: "decoder",
    PlainActor: "plain",
    GaussianActor: "gaussian",
}
"""Actors that the NumPy runtime knows, and its names of them."""
PROBES = 8
"""Actions that are stored with the noise they came from."""


class ExportError(ValueError):
    """A policy that cannot run without JAX; the message says what can."""


class Exported(NamedTuple):
    """A policy's folder, as it was found good after writing."""

    folder: Path
    policy: Policy


def export(trained: Trained, out: Path | None) -> Exported:
    """Write a run's policy into `out` (or beside its checkpoints), and load it as a robot's computer would.

    Raises:
        ExportError: the runtime has no such actor, the selector needs a critic, or the run diverged.
        PolicyFolderError: the place is taken, or NumPy does not do what JAX does.
    """
    selector = _selector(trained)
    kind = _kind(trained)
    state = take(trained.states, 0)
    arrays = {**_named("actor", state.actor), **_named("moments", getattr(state, "actor_moments", ()))}
    if not all(np.isfinite(array).all() for array in arrays.values()):
        raise ExportError(f"run {trained.folder.path} diverged: its actor has numbers that are not finite")
    arrays |= _probe(trained, state)
    evaluations = last_evaluations(load_run(trained.folder.path), trained.step)
    facts = _facts(trained, kind, selector, evaluations)
    chooses = BARE if selector.alone else f"{selector.rule}-k{selector.candidates}"
    name = f"step_{trained.step:09d}_{chooses}_{facts['adapter']}"
    folder = out or trained.folder.path / "exports" / name
    parcels.write(folder, facts, arrays, model_card(facts, evaluations))
    return Exported(folder, Policy.load(folder))


def _selector(trained: Trained) -> Selector:
    selector = trained.settings.evaluation_selector
    if trained.name == BARE:
        return Selector("first", candidates=1)
    if selector.needs_values:
        raise ExportError(
            f"the selector {selector.rule!r} ranks by a critic, and an exported policy has none; "
            "export with one that reads the scene: --selector hcpg"
        )
    return selector


def _kind(trained: Trained) -> str:
    actor = type(trained.states.actor)
    if actor not in KINDS:
        raise ExportError(
            f"an actor of the method {trained.settings.method!r} ({actor.__name__}) cannot be exported; "
            "those of SAC-Flow (velocity gated, plain or decoder) and of SAC can"
        )
    return KINDS[actor]


def _named(prefix: str, tree: Any) -> dict[str, np.ndarray]:
    """The floating-point arrays of a tree, by dotted names."""
    leaves = [(keystr(path, simple=True, separator="."), leaf) for path, leaf in tree_leaves_with_path(tree)]
    return {f"{prefix}.{name}": np.asarray(leaf) for name, leaf in leaves if eqx.is_inexact_array(leaf)}


def _probe(trained: Trained, state: Any) -> dict[str, np.ndarray]:
    """What the network does on an observation of its task, and with which noise."""
    observation = _observation(trained)
    noise, actions = sampled(trained.method, state, jax.numpy.asarray(observation), PROBES)
    return {"probe.observation": observation, "probe.noise": noise, "probe.actions": actions}


def _observation(trained: Trained) -> np.ndarray:
    """One of the run's training; for a clone or a run on an arm, which keep none, the task's first one."""
    path = trained.folder.checkpoints / f"step_{trained.step:09d}"
    if "observations" in checkpoints.trees(path):
        (observations,) = checkpoints.load_raw(path, "observations").values()
        return np.asarray(observations[0], np.float32)
    task = registry.task(trained.settings.task)
    with closing(registry.suite(task.suite).make(task, seed=trained.seed)) as environment:
        return np.asarray(environment.reset(0), np.float32)


def sampled(
    method: Method, state: Any, observation: Float[Tensor, " O"], count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Noise [D, K, A] and the actions [K, A] that the method's actor makes of it, in full float32."""
    sizes, key = (count, method.spec.action_size), jax.random.key(0)
    with jax.default_matmul_precision("highest"):
        if isinstance(state.actor, FlowActor):
            noise = Noise.draw(key, sizes, method.config.flow_steps)
            path = state.actor.infer(state.actor_moments, observation[None], noise)
            return np.concatenate([noise.start[None], noise.steps]), np.asarray(path.actions)
        draw = jax.random.normal(key, sizes)
        return np.asarray(draw[None]), np.asarray(state.actor(observation).sample(draw).actions)


def _facts(
    trained: Trained, kind: str, selector: Selector, evaluations: tuple[Evaluation, ...]
) -> dict[str, Any]:
    settings, spec, manifest = trained.settings, trained.method.spec, trained.folder.manifest()
    return {
        "task": settings.task,
        "adapter": settings.adapter,
        "selector": asdict(selector),
        "observation_size": spec.observation_size,
        "action_size": spec.action_size,
        "network": {
            "kind": kind,
            "flow_steps": getattr(settings.learner, "flow_steps", 0),
            "norm_epsilon": EPSILON,
            "log_deviation_range": LOG_DEVIATION_RANGE,
        },
        "origin": {
            "run": manifest["run"]["id"],
            "method": settings.method,
            "preset": settings.preset,
            "budget": settings.budget.name,
            "budget_steps": settings.budget.steps,
            "seed": trained.seed,
            "step": trained.step,
            "adapter_of_run": trained.folder.config()["adapter"],
            "hcpg_version": hcpg.__version__,
        },
        "evaluations": [each._asdict() for each in evaluations],
    }
