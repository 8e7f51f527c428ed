"""Runs with a checkpoint of an actor that has learned nothing, but whose every number is another."""

from dataclasses import replace

import jax
import numpy as np
from jax import numpy as jnp

from hcpg import presets, registry
from hcpg.loops import checkpoints
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import stack
from hcpg.loops.trained import Trained
from hcpg.report.rows import append_rows
from hcpg.selection import Selector
from hcpg.types import Spec

TASK, STEP = "point/reach", 480
SPEC = Spec(11, 4)


def shaken(tree):
    """Every number moved at random, variances kept above 0.1: no layer is zero, no norm the identity."""
    random = np.random.default_rng(3)

    def moved(path, leaf):
        if not jnp.issubdtype(leaf.dtype, jnp.floating):
            return leaf
        noise = random.normal(0.0, 0.1, leaf.shape).astype(np.float32)
        is_variance = getattr(path[-1], "name", "") == "variance"
        return jnp.abs(leaf + noise) + 0.1 if is_variance else leaf + noise

    return jax.tree_util.tree_map_with_path(moved, tree)


def a_run(root, method="sac_flow", selector=None, successes=(1, 3), **learner):
    """A run folder with one checkpoint and an evaluation of 4 episodes each at half its steps and its end."""
    usual = presets.settings(TASK, "hcpg_flow", "cpu")
    module = registry.method(method)
    config = replace(module.Config(), **learner)
    selector = selector or Selector("hcpg", candidates=4)
    settings = replace(
        usual, preset="tested", method=method, learner=config, selector=selector, evaluation_selector=selector
    )
    address = {"task": TASK, "preset": "tested", "seed": 5}
    folder = RunFolder.create(root, **address, config=settings.as_json(), manifest={})
    algorithm = module.METHOD(config, SPEC)
    state = algorithm.init(jax.random.key(1))
    moments = {"actor_moments": shaken(state.actor_moments)} if hasattr(state, "actor_moments") else {}
    state = state._replace(actor=shaken(state.actor), **moments)
    observations = np.random.default_rng(4).normal(0.0, 0.3, (2, SPEC.observation_size)).astype(np.float32)
    trees = {"state": state, "observations": {"next": observations}}
    checkpoints.save(folder.checkpoints, STEP, trees, {})
    append_rows(folder.path / "episodes.jsonl", _rows(selector, successes))
    name = "bare" if selector.alone else selector.rule
    read_scene = registry.task(TASK).adapters["paper"]
    return Trained(folder, 5, settings, name, algorithm, read_scene, stack([state]), STEP)


def _rows(selector, successes):
    acting = {"selector": "bare" if selector.alone else selector.rule, "adapter": "paper"}
    for step, count in zip((STEP // 2, STEP), successes, strict=True):
        for start in range(4):
            facts = {"step": step, "phase": "evaluation", "start": start, "length": 9, "return": 0.0}
            done = start < count
            yield {
                **facts, **acting, "success_once": done, "success_at_end": done,
                "steps_to_success": 5 if done else None, "environment": start,
            }  # fmt: skip
