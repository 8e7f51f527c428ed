"""Runs small enough for a test: the point task, 16-wide networks, four environments."""

import json
from dataclasses import replace

from hcpg import presets
from hcpg.loops import sitting
from hcpg.loops.runs import RunFolder

STEPS = 240


def tiny_settings(steps=STEPS, evaluations=2, **learner):
    """60 ticks of 4 environments by default: one whole episode of each."""
    full = presets.settings("point/reach", "hcpg_flow", "cpu")
    budget = replace(
        full.budget,
        steps=steps,
        environments=4,
        updates_per_step=0.5,
        warmup_steps=40,
        batch_size=16,
        evaluations=evaluations,
        evaluation_episodes=4,
        replay_capacity=1024,
    )
    sizes = replace(
        full.learner, flow_steps=2, target_entropy=0.0, actor_hidden_size=16, critic_hidden_size=16, **learner
    )
    return replace(full, learner=sizes, budget=budget)


def sit(settings, folders, stop=lambda: False):
    """Train in this process; gives the events."""
    events = []
    sitting.sit(settings, folders, 1, events.append, stop)
    return events


def checkpoint_digests(folder: RunFolder):
    """SHA-256 of every array file of the newest checkpoint, and its facts without the clock."""
    newest = sorted(folder.checkpoints.glob("step_*"))[-1]
    document = json.loads((newest / "facts.json").read_text())
    facts = {name: fact for name, fact in document["facts"].items() if name != "wall_s"}
    return newest.name, {name: file["sha256"] for name, file in document["files"].items()}, facts
