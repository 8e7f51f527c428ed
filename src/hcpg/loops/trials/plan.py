"""What is tried, frozen before the first trial: task, arm, limits, policies, start states, their order."""

import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from hcpg.loops.control.step_log import plain
from hcpg.robot_types import Limits

START_STATES = 10_000
"""Start states are drawn from so many."""
LETTERS = "BCDFGHJKLMNPQRSTVWXZ"
"""Of the codes; without vowels no code is a word."""
CODE_LENGTH = 4


class PlanError(ValueError):
    """A plan that cannot be carried out; the message says why."""


@dataclass(frozen=True)
class Plan:
    """Everything that decides what the trials of one task measure."""

    task: str
    robot: str
    kind: str
    """Whether a real arm moves."""
    served: bool
    """Whether the arm is reached over a network, at an address."""
    limits: Limits
    horizon: int
    """Most actions of a trial; what a failure counts as, in steps."""
    seed: int
    """Draws the start states, the order, the codes, and every draw of the policies."""
    trials: int
    """Of each policy."""
    policies: Mapping[str, Mapping[str, Any]]
    """By name: what acts (a checkpoint by its digest), and how it selects."""

    def __post_init__(self) -> None:
        """Refuse what measures nothing.

        Raises:
            PlanError: no policy or no trial, or more trials than start states.
        """
        if not self.policies:
            raise PlanError("no policy to try; name one: --policy NAME=RUN")
        if not 1 <= self.trials <= START_STATES:
            raise PlanError(f"{self.trials} trials; choose 1 to {START_STATES}")

    def as_json(self) -> dict[str, Any]:
        """Plain values, start states and order too: what is hashed."""
        values = {name: value for name, value in asdict(self).items() if name != "limits"}
        order = [[slot.code, slot.policy, slot.start] for slot in slots(self)]
        return plain({**values, "limits": asdict(self.limits), "starts": list(starts(self)), "order": order})


class Slot(NamedTuple):
    """One trial to be run."""

    number: int
    """From 1, in the order of running."""
    code: str
    """What the operator sees instead of the policy's name; another one for every trial."""
    policy: str
    start: int


def starts(plan: Plan) -> tuple[int, ...]:
    """The start states, the same for every policy."""
    drawn = np.random.default_rng([plan.seed, 0]).choice(START_STATES, plan.trials, replace=False)
    return tuple(int(each) for each in drawn)


def slots(plan: Plan) -> list[Slot]:
    """All trials in the order of running, ABBA: the policies' order is turned round at every second start.

    Which policy comes first is drawn anew for every such pair, and for every task: the order of one tells
    nobody who acts in the next.
    """
    names, order, turn = list(plan.policies), [], [""]
    random = np.random.default_rng([plan.seed, 1, zlib.crc32(plan.task.encode())])
    for place, start in enumerate(starts(plan)):
        drawn = [names[index] for index in random.permutation(len(names))]
        turn = drawn if place % 2 == 0 else turn[::-1]
        order += [(name, start) for name in turn]
    codes = _codes(random, len(order))
    return [Slot(number, codes[number - 1], *each) for number, each in enumerate(order, start=1)]


def _codes(random: np.random.Generator, count: int) -> list[str]:
    """As many different codes."""
    codes = dict[str, None]()
    while len(codes) < count:
        codes["".join(random.choice(list(LETTERS), CODE_LENGTH))] = None
    return list(codes)
