"""Who can be tried: what names a policy in the plan, and what chooses its actions."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any, NamedTuple

from hcpg.interfaces import RobotTask, Task
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.proposing import uniform
from hcpg.selection import Selector


class Contender(NamedTuple):
    """One policy of a plan."""

    facts: Mapping[str, Any]
    """What it is, for the plan and its hash."""
    chooser: Callable[[int], Chooser]
    """What chooses in a trial: the number, its start state, names every draw."""


def chance(address: Task, task: RobotTask, selector: Selector, adapter: str, seed: int) -> Contender:
    """Uniform proposals: what the selector alone makes of chance."""

    def chooser(start: int) -> Chooser:
        propose = partial(uniform, seed + start, task.action_size)
        return Chooser(propose, selector, address.adapters[adapter], task.action_size, seed + start)

    return Contender(
        {"source": "uniform proposals", "selector": asdict(selector), "adapter": adapter}, chooser
    )
