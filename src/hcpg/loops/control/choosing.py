"""From an observation to one action on the robot's computer: propose, read the scene, select; NumPy alone."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hcpg.interfaces import ReadScene
from hcpg.selection import Selector, select
from hcpg.types import Float, Tensor

Propose = Callable[[Float[Tensor, " O"], int, int], Float[Tensor, "K A"]]
"""A policy: (observation, how many, a count that names the draw) -> candidate actions in [-1, 1]."""


class UnservedSelectorError(ValueError):
    """A selector that needs what a robot's computer does not have; the message says what."""


class Choice(NamedTuple):
    """What was proposed and chosen; the K proposals are kept beside what is executed."""

    proposals: Float[np.ndarray, "..."]
    """[K, A], as the policy gave them."""
    action: Float[np.ndarray, " A"]
    weights: Float[np.ndarray, " K"]
    scores: Float[np.ndarray, " K"]
    """Contact progress; NaN where nothing was selected."""
    phase: float
    """0 before contact, 1 after it; NaN where nothing was selected."""
    spread: float
    """Of the proposals, in units of the action."""
    unfit: str
    """Why there is no action to execute; "" where there is one."""


class Chooser:
    """A policy and a selector. Every draw depends on the seed and the draw's count alone."""

    def __init__(
        self, propose: Propose, selector: Selector, read_scene: ReadScene, action_size: int, seed: int
    ) -> None:
        """Refuse what could not be carried out.

        Raises:
            UnservedSelectorError: the selector ranks by a critic, and there is none here.
        """
        if selector.needs_values:
            raise UnservedSelectorError(
                f"the selector {selector.rule!r} needs a critic, and an exported policy has none; "
                "take one that reads the scene: hcpg"
            )
        self._propose, self._selector, self._read_scene = propose, selector, read_scene
        self._action_size, self._seed = action_size, seed

    def choose(self, observation: Float[Tensor, " O"], draw: int, alone: bool) -> Choice:
        """One action for one observation; `alone` asks for one proposal and selects nothing."""
        count = 1 if alone else self._selector.candidates
        proposals = np.asarray(self._propose(observation, count, draw))
        unfit = self._unfit(proposals, count)
        if unfit:
            return _nothing(proposals, self._action_size, count, unfit)
        if alone:
            first = np.clip(proposals[0], -1.0, 1.0)
            return Choice(proposals, first, np.ones(1), np.full(1, np.nan), np.nan, 0.0, "")
        noise = np.random.default_rng([self._seed, draw]).uniform(size=count)
        extra = {"noise": noise.astype(proposals.dtype)} if self._selector.needs_noise else {}
        scene = self._read_scene(np.asarray(observation))
        action, seen = select(proposals, scene, self._selector, **extra)
        return Choice(proposals, action, seen.weights, seen.scores, float(seen.phase), float(seen.spread), "")

    def _unfit(self, proposals: np.ndarray, count: int) -> str:
        shape = (count, self._action_size)
        if proposals.shape != shape:
            return f"the policy gave proposals of shape {proposals.shape}, not {shape}"
        if proposals.dtype not in (np.float32, np.float64):
            return f"the policy gave proposals of type {proposals.dtype}"
        return "" if np.isfinite(proposals).all() else "the policy gave proposals that are not finite"


def _nothing(proposals: np.ndarray, action_size: int, count: int, unfit: str) -> Choice:
    nan = np.full(count, np.nan)
    return Choice(proposals, np.zeros(action_size), nan, nan, np.nan, np.nan, unfit)
