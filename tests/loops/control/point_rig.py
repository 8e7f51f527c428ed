"""A session of the point arm: everything real, on a clock that jumps."""

import json
from functools import partial

import numpy as np

from hcpg import registry
from hcpg.interfaces import Rig
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.episodes import Crew, Episode
from hcpg.loops.control.step_log import StepLog
from hcpg.loops.control.workers import InlineWorker
from hcpg.selection import Selector

OPEN: list[StepLog] = []
TASK, ROBOT_TASK = registry.task("point/reach"), registry.robot_task("point/reach")


def new_rig():
    return registry.robot("point").make("point/reach", None)


def uniform(observation, count, draw):
    return np.random.default_rng(draw).uniform(-1, 1, (count, 4))


def constant(*action):
    """A policy that always proposes the same."""
    return lambda observation, count, draw: np.tile(np.asarray(action, float), (count, 1))


def crew(folder, propose=uniform, rig=None, task=ROBOT_TASK, selector=None):
    parts: Rig = rig or new_rig()
    chooser = Chooser(propose, selector or Selector(), TASK.adapters["paper"], 4, 0)
    log = StepLog(folder / "steps.jsonl", threaded=False)
    OPEN.append(log)
    return Crew.of(parts, task, chooser, InlineWorker(parts.robot.clock), log)


def ready(folder, **parts):
    """A crew whose arm is connected and at its start."""
    made = crew(folder, **parts)
    made.rig.robot.connect(1.0)
    made.rig.robot.reset(ROBOT_TASK.home, "open", 5.0)
    return made


def episode(folder, horizon=20, **parts):
    made = ready(folder, **parts)
    result = Episode(made, 0, 0, horizon).run()
    made.log.close()
    return result


def rows(folder, kind="step"):
    lines = (folder / "steps.jsonl").read_text().splitlines()
    return [row for row in map(json.loads, lines) if row["kind"] == kind]


class Scripted:
    """Passes on to what it wraps, but for the attributes given."""

    def __init__(self, wrapped, **replaced):
        self._wrapped = wrapped
        for name, value in replaced.items():
            setattr(self, name, value if not callable(value) else partial(value, wrapped))

    def __getattr__(self, name):
        return getattr(self._wrapped, name)
