"""Cells that train in seconds, on the suite without a simulator."""

from dataclasses import replace

from hcpg import presets
from hcpg.experiments.protocols import Cell

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
