"""One episode as it was lived: what was seen, proposed, weighed and executed at every step."""

from typing import NamedTuple

import numpy as np

from hcpg.types import Float, Scene, UInt8


class Thought(NamedTuple):
    """What the selector knew and did at one step."""

    proposals: Float[np.ndarray, "K A"]
    weights: Float[np.ndarray, " K"]
    scores: Float[np.ndarray, " K"]
    """Contact progress, in the action's units."""
    scene: Scene
    """Tool, object, goal; the vector to close before contact, and the one after it; m."""
    phase: float
    """0 before contact, 1 after it."""
    spread: float
    """Root mean square distance of the proposals to their mean, in the action's units."""
    blend_gap: float
    """Distance from the action to the nearest proposal, in the action's units."""


class Moment(NamedTuple):
    """One step of an episode."""

    tick: int
    """Steps before this one."""
    picture: UInt8[np.ndarray, "H W 3"] | None
    """Before the action; None where steps are left out of the video."""
    thought: Thought | None
    """None where no selector acts."""
    action: Float[np.ndarray, " A"]
    reward: float
    """For the action."""
    success: bool
    """Whether the task's condition held after the action."""


class Rollout(NamedTuple):
    """One episode, from its first step to its last."""

    task: str
    preset: str
    seed: int
    step: int
    """Environment steps of training at the checkpoint that acted."""
    selector: str
    start: int
    """Start state of the evaluation's list."""
    translation: tuple[int, int]
    """First index of the translation within an action, and the index after its last."""
    moments: list[Moment]

    @property
    def success_tick(self) -> int | None:
        """The first step after which the task's condition held; None if it never did."""
        return next((moment.tick for moment in self.moments if moment.success), None)

    @property
    def title(self) -> str:
        """Which episode this is, in words."""
        return (
            f"{self.task}, {self.preset} seed {self.seed} at step {self.step:,}, selector {self.selector}, "
            f"start state {self.start}"
        )
