"""Who can be tried: what names a policy in the plan, and what chooses its actions."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.interfaces import RobotTask, Task
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.deployed import Policy
from hcpg.loops.control.proposing import uniform
from hcpg.loops.trials.plan import PlanError
from hcpg.selection import Selector


class Contender(NamedTuple):
    """One policy of a plan."""

    facts: Mapping[str, Any]
    """What it is, for the plan and its hash."""
    chooser: Callable[[int], Chooser]
    """What chooses in a trial: the number, its start state, names every draw."""


ALONE = Selector("first", candidates=1)
"""One proposal, which is executed."""
BARE = "bare"


def chance(address: Task, task: RobotTask, selector: Selector, adapter: str, seed: int) -> Contender:
    """Uniform proposals: what the selector alone makes of chance."""

    def chooser(start: int) -> Chooser:
        propose = partial(uniform, seed + start, task.action_size)
        return Chooser(propose, selector, address.adapters[adapter], task.action_size, seed + start)

    return Contender(
        {"source": "uniform proposals", "selector": asdict(selector), "adapter": adapter}, chooser
    )


def exported(path: Path, rule: str | None, address: Task, task: str, seed: int) -> Contender:
    """What `hcpg export` wrote into `path`, run by NumPy; `rule` is another one than its own selector's.

    Raises:
        PlanError: it is a policy for another task.
        PolicyFolderError: the folder is damaged or of another version, or what it holds acts differently.
    """
    policy = Policy.load(path)
    if policy.task != task:
        raise PlanError(
            f"the policy in {path} is one for {policy.task}, not for {task}; name one of that task"
        )
    own = policy.selector
    others = own if own.candidates > 1 else Selector()
    selector = own if rule is None else ALONE if rule == BARE else replace(others, rule=rule)

    def chooser(start: int) -> Chooser:
        read_scene, size = address.adapters[policy.adapter], policy.action_size
        return Chooser(policy.proposer(seed + start), selector, read_scene, size, seed + start)

    facts = {"source": "exported policy", "sha256": policy.digest, "selector": asdict(selector)}
    return Contender({**facts, "adapter": policy.adapter}, chooser)
