"""The other tasks of Meta-World's fifty: one contact reading with four settings, or a reason to refuse.

Followed greedily (`scripts/adapter_check.py`), the reading solves each task of `FAMILY` in at least half of
its episodes, and most of them in all.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from hcpg.interfaces import ReadScene, Task
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag, funnel
from hcpg.tasks.metaworld import CONTROL, GOAL, HAND, HORIZON, OBJECT, OPENING, read_paper_scene, tip
from hcpg.types import Float, Scene, Tensor

WIDEST_GRASP = 0.75
"""The fingers hold something, or nothing, below this opening."""
LIFT_RADIUS_M, LIFT_HEIGHT_M = 0.04, 0.15


@dataclass(frozen=True)
class ContactReading:
    """The fingertips go to the object, then the object to its goal."""

    contact_m: float
    """The fingertips touch the object within this distance."""
    funnel_m: tuple[float, float] | None = None
    """Radius and height of the funnel through which they come down; None: they come straight."""
    grasps: bool = False
    """Whether contact also takes fingers that have closed."""
    lifts: bool = False
    """Whether the object goes to its goal from above."""

    def __call__(self, observation: Float[Tensor, "*batch O"]) -> Scene:
        """The scene of one observation, or of a batch."""
        tool, item, goal = tip(observation), observation[..., OBJECT], observation[..., GOAL]
        touches = length(item - tool) < self.contact_m
        if self.grasps:
            touches = touches & (observation[..., OPENING] < WIDEST_GRASP)
        approach = (funnel(tool, item, *self.funnel_m) if self.funnel_m else item) - tool
        task = (funnel(item, goal, LIFT_RADIUS_M, LIFT_HEIGHT_M) if self.lifts else goal) - item
        return Scene(tool, item, goal, approach, task, flag(touches, observation))


def read_paper_reach(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand is what shall be at the goal; the observed object plays no part."""
    hand, goal = observation[..., HAND], observation[..., GOAL]
    return Scene(hand, hand, goal, goal - hand, goal - hand, None)


def read_contact_reach(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The fingertips are what shall be at the goal, from the first step."""
    tool, goal = tip(observation), observation[..., GOAL]
    always = flag(length(goal - tool) >= 0.0, observation)
    return Scene(tool, tool, goal, goal - tool, goal - tool, always)


def _task(name: str, paper: ReadScene, contact: ReadScene) -> Task:
    return Task("metaworld", f"{name}-v3", HORIZON, CONTROL, {"paper": paper, "contact": contact})


_PRESS = ContactReading(contact_m=0.08)
_PUSH = ContactReading(contact_m=0.03)
_PUSH_FROM_ABOVE = ContactReading(contact_m=0.03, funnel_m=(0.04, 0.10))
_CARRY = ContactReading(contact_m=0.035, funnel_m=(0.02, 0.10), grasps=True)
_LIFT = ContactReading(contact_m=0.035, funnel_m=(0.02, 0.10), grasps=True, lifts=True)

_READINGS = {
    "basketball": _LIFT,
    "bin-picking": _LIFT,
    "button-press-topdown": _PRESS,
    "button-press-topdown-wall": _PRESS,
    "button-press-wall": _PUSH_FROM_ABOVE,
    "coffee-button": _PUSH,
    "coffee-pull": _LIFT,
    "coffee-push": _CARRY,
    "dial-turn": _PUSH,
    "disassemble": _LIFT,
    "door-close": _PUSH,
    "door-lock": _PUSH_FROM_ABOVE,
    "door-unlock": _PUSH_FROM_ABOVE,
    "drawer-close": _PRESS,
    "faucet-close": _PRESS,
    "faucet-open": _PRESS,
    "hammer": _CARRY,
    "hand-insert": _LIFT,
    "handle-press": _PUSH,
    "handle-press-side": _PRESS,
    "peg-unplug-side": _LIFT,
    "pick-out-of-hole": _CARRY,
    "pick-place": _CARRY,
    "pick-place-wall": _CARRY,
    "plate-slide": _PUSH,
    "plate-slide-back": _PUSH,
    "plate-slide-back-side": _PUSH,
    "plate-slide-side": _PUSH,
    "push": _CARRY,
    "push-back": _CARRY,
    "shelf-place": _LIFT,
    "soccer": _CARRY,
    "stick-push": _CARRY,
    "sweep": _CARRY,
    "window-close": _PUSH,
    "window-open": _PUSH,
}
_REACHES = ("reach", "reach-wall")

FAMILY: Mapping[str, Task] = {
    **{name: _task(name, read_paper_scene, reading) for name, reading in _READINGS.items()},
    **{name: _task(name, read_paper_reach, read_contact_reach) for name in _REACHES},
}
"""Tasks by name that this family reads."""

REFUSED: Mapping[str, str] = {
    "assembly": "the nut is held at its handle and its ring goes over the peg; the observed point is neither",
    "box-close": "the lid has to be lifted onto the box, and does not stay in a grasp at the observed point",
    "handle-pull": "the handle has to be hooked from below and turned up along an arc",
    "handle-pull-side": "the handle has to be hooked from below and turned up along an arc",
    "push-wall": "a wall stands between object and goal, so the way there is a detour",
    "stick-pull": "the stick goes through the handle of a second object, and the goal is that object's",
}
"""Tasks by name that it does not, each with the reason: the direction it would give leads nowhere."""
