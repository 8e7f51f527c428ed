"""Cells that train in seconds, on the suite without a simulator, and places for them."""

import time
from dataclasses import replace

from hcpg import presets
from hcpg.experiments.local import ThisMachine
from hcpg.experiments.protocols import Cell
from hcpg.experiments.slots import core_slots
from hcpg.loops.runs import RunFolder
from hcpg.report.records import find_runs

BUDGET = {
    "steps": 64,
    "environments": 2,
    "warmup_steps": 16,
    "batch_size": 8,
    "evaluations": 2,
    "evaluation_episodes": 2,
    "replay_capacity": 256,
}


def cell(seed=0, **budget):
    usual = presets.settings("point/reach", "sac")
    learner = replace(usual.learner, actor_hidden_size=8, critic_hidden_size=8)
    return Cell(replace(usual, learner=learner, budget=replace(usual.budget, **{**BUDGET, **budget})), seed)


def on_cores(cores):
    return ThisMachine(core_slots(cores), together=False)


def await_rows(results):
    """The first run under `results` that trains, once it has written down that it does."""
    while True:
        for path in find_runs(results) if results.exists() else ():
            if RunFolder(path).rows("metrics"):
                return RunFolder(path)
        time.sleep(0.05)
