"""The rules that turn what is known about K proposals into K weights, and the settings they share."""

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from hcpg.selection.arrays import namespace, ranks
from hcpg.selection.blending import equal_weights, soft_weights, standardise
from hcpg.types import Bool, Float, Tensor

RuleName = Literal["hcpg", "first", "mean", "random", "argmax", "permuted", "value", "value_soft"]
Direction = Literal["scene", "opposed", "random"]

# Limits within which no setting can overflow in float32; every sensible value lies far inside.
_LIMITS = {
    "candidates": (1, 1_000_000),
    "temperature": (1e-6, 1e6),
    "gate_radius_m": (0.0, 1e6),
    "action_penalty": (0.0, 1e6),
    "epsilon": (1e-30, 1.0),
}


@dataclass(frozen=True)
class Selector:
    """A selection rule and its settings; the defaults are the paper's."""

    rule: RuleName = "hcpg"
    """Which of `RULES` weighs the proposals."""
    direction: Direction = "scene"
    """Where progress points: to the scene's targets, away from them, or anywhere (a new draw each time)."""
    candidates: int = 4
    """How many proposals (K) a loop asks for; `select` itself takes however many it is given."""
    temperature: float = 0.7
    """Softness of the soft rules: towards 0 the best alone, large the plain mean."""
    gate_radius_m: float = 0.08
    """Without a contact flag, contact begins where the approach vector is shorter than this, m."""
    action_penalty: float = 0.05
    """Price per unit of translation in the score, which breaks ties in favour of small moves."""
    epsilon: float = 1e-6
    """Smallest divisor: of the length of a target vector (m) and of the scores' standard deviation."""
    top_k: int | None = None
    """The soft rules weigh only this many best candidates; None, or K and more, weighs all."""
    translation: tuple[int, int] = (0, 3)
    """First index of the x, y, z translation within an action, and the index after its last."""
    bounds: tuple[float, float] | None = (-1.0, 1.0)
    """What the blend is clipped to; None leaves it anywhere within the proposals' range."""

    def __post_init__(self) -> None:
        """Refuse settings that mean nothing.

        Raises:
            ValueError: an unknown rule or a setting out of range; the message lists what is possible.
        """
        if self.rule not in RULES:
            near = difflib.get_close_matches(str(self.rule), RULES, n=1)
            guess = f" Did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"no selection rule is named {self.rule!r}.{guess} Known: {', '.join(RULES)}.")
        if self.direction not in get_args(Direction):
            known = ", ".join(get_args(Direction))
            raise ValueError(f"no direction is named {self.direction!r}. Known: {known}.")
        for name, (low, high) in _LIMITS.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must lie in [{low:g}, {high:g}]")
        if self.top_k is not None and self.top_k < 1:
            raise ValueError(f"top_k is {self.top_k}; keep at least 1 candidate, or None to keep all")
        start, stop = self.translation
        if start < 0 or stop != start + 3:
            raise ValueError(f"translation is {self.translation}; it must be (i, i + 3) with i at least 0")
        if self.bounds is not None and not self.bounds[0] < self.bounds[1]:
            raise ValueError(f"bounds is {self.bounds}; the lower must lie below the upper, or give None")

    @property
    def alone(self) -> bool:
        """Whether there is one proposal, so that nothing is selected."""
        return self.candidates == 1

    @property
    def needs_noise(self) -> bool:
        """Whether the rule or the direction draws lots, so that `select` must be given `noise`."""
        return RULES[self.rule].needs_noise or self.direction == "random"

    @property
    def needs_values(self) -> bool:
        """Whether the rule ranks by a critic, so that `select` must be given `values`."""
        return RULES[self.rule].needs_values


class Evidence(NamedTuple):
    """What is known about K proposals when a rule weighs them."""

    scores: Float[Tensor, "*batch K"]
    """Contact progress of each, in units of the translation."""
    usable: Bool[Tensor, "*batch K"]
    """False where a number of the candidate is not finite; it then gets weight 0."""
    noise: Float[Tensor, "*batch K"] | None
    """Independent uniform numbers, for the rules that draw lots."""
    values: Float[Tensor, "*batch K"] | None
    """A critic's value of each, for the rules that rank by it."""


class Rule(NamedTuple):
    """How one rule weighs, and what it has to be given."""

    weigh: Callable[[Selector, Evidence], Float[Tensor, "*batch K"]]
    """From the settings and the evidence to weights that sum to 1."""
    needs_noise: bool = False
    """Whether it reads `Evidence.noise`."""
    needs_values: bool = False
    """Whether it reads `Evidence.values`."""


def _hcpg(selector: Selector, evidence: Evidence) -> Tensor:
    return _soft(evidence.scores, selector, evidence.usable)


def _first(selector: Selector, evidence: Evidence) -> Tensor:
    return _winner(namespace(evidence.scores).zeros_like(evidence.scores), evidence.usable)


def _mean(selector: Selector, evidence: Evidence) -> Tensor:
    return equal_weights(evidence.usable, evidence.scores.dtype)


def _random(selector: Selector, evidence: Evidence) -> Tensor:
    return _winner(evidence.noise, evidence.usable)


def _argmax(selector: Selector, evidence: Evidence) -> Tensor:
    return _winner(evidence.scores, evidence.usable)


def _permuted(selector: Selector, evidence: Evidence) -> Tensor:
    """HCPG's weights, the largest to whoever drew the largest lot: the same blend, without geometry."""
    weights = _hcpg(selector, evidence)
    xp = namespace(weights)
    lots = xp.where(evidence.usable, evidence.noise, -float("inf"))
    dealt = ranks(lots)[..., :, None] == ranks(weights)[..., None, :]
    return xp.sum(xp.where(dealt, weights[..., None, :], 0.0), axis=-1)


def _value(selector: Selector, evidence: Evidence) -> Tensor:
    return _winner(evidence.values, evidence.usable)


def _value_soft(selector: Selector, evidence: Evidence) -> Tensor:
    return _soft(evidence.values, selector, evidence.usable)


def _soft(numbers: Tensor, selector: Selector, usable: Tensor) -> Tensor:
    standardised = standardise(numbers, usable, selector.epsilon)
    return soft_weights(standardised, usable, selector.temperature, selector.top_k)


def _winner(numbers: Tensor, usable: Tensor) -> Tensor:
    """Weight 1 for the usable candidate with the largest number, of equals the first."""
    xp = namespace(numbers)
    place = ranks(xp.where(usable, numbers, -float("inf")))
    return xp.asarray(usable & (place == 0), dtype=numbers.dtype)


RULES: Mapping[str, Rule] = {
    "hcpg": Rule(_hcpg),
    "first": Rule(_first),
    "mean": Rule(_mean),
    "random": Rule(_random, needs_noise=True),
    "argmax": Rule(_argmax),
    "permuted": Rule(_permuted, needs_noise=True),
    "value": Rule(_value, needs_values=True),
    "value_soft": Rule(_value_soft, needs_values=True),
}
"""Every rule by name: what the paper proposes, and the controls that take it apart."""
