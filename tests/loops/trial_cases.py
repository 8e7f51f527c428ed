"""Trials on the point arm: everything real, on a clock that jumps."""

from functools import partial

import numpy as np

from hcpg import registry
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.trials.ledger import Ledger
from hcpg.loops.trials.operator import Nobody
from hcpg.loops.trials.plan import Plan
from hcpg.loops.trials.running import Arena, run_trials
from hcpg.robots.point import LIMITS
from hcpg.selection import Selector

TASK, ROBOT_TASK = registry.task("point/reach"), registry.robot_task("point/reach")


def plan(trials=2, policies=2, **changed):
    names = {name: {"sha256": f"digest of {name}"} for name in "abc"[:policies]}
    facts = {"robot": "point", "kind": "twin", "served": False, "limits": LIMITS, "horizon": 60, "seed": 0}
    return Plan("point/reach", **facts, trials=trials, policies=names, **changed)


def towards(observation, count, draw):
    """Straight to the object, a full step at a time."""
    way = np.asarray(observation[4:7] - observation[0:3], float) / LIMITS.step_m
    move = way * min(1.0, 1.0 / max(float(np.linalg.norm(way)), 1e-9))
    return np.tile([*move, 0.0], (count, 1))


def still(observation, count, draw):
    return np.zeros((count, 4))


def by_chance(start, observation, count, draw):
    return np.random.default_rng([start, draw]).uniform(-1, 1, (count, 4))


def chooser(propose, start):
    return Chooser(propose, Selector(), TASK.adapters["paper"], 4, start)


def chance_chooser(start):
    return chooser(partial(by_chance, start), start)


def arena(rig=None, operator=None, referee=None, task=ROBOT_TASK, **choosers):
    """Policy `a` reaches the object, `b` stands still, unless others are given."""
    parts = rig or registry.robot("point").make("point/reach", None)
    known = {"a": partial(chooser, towards), "b": partial(chooser, still), **choosers}
    return Arena(parts, task, known, operator or Nobody(), True, referee, 60)


def run(folder, made, trials=2, told=None, policies=2):
    with Ledger(folder, plan(trials=trials, policies=policies)) as ledger:
        progress = run_trials(made, ledger, (told if told is not None else []).append)
        return progress, ledger.attempts
