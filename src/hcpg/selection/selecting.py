"""The one call: K proposals and a scene in, the action to execute out."""

from typing import NamedTuple

from hcpg.selection.arrays import bounded, length, namespace
from hcpg.selection.blending import blend
from hcpg.selection.inputs import Inputs, gather
from hcpg.selection.progress import contact_phase, random_direction, score
from hcpg.selection.selectors import RULES, Evidence, RuleName, Selector
from hcpg.types import Bool, Float, Scene, Tensor


class Diagnostics(NamedTuple):
    """What the selector saw and did, per candidate set."""

    weights: Float[Tensor, "*batch K"]
    """Share of each proposal in the action; at least 0, sum 1."""
    scores: Float[Tensor, "*batch K"]
    """Contact progress of each proposal, in the action's units; given for every rule."""
    phase: Float[Tensor, "*batch"]
    """0 before contact, 1 after it."""
    spread: Float[Tensor, "*batch"]
    """Root mean square distance of the proposals to their mean, in the action's units."""
    blend_gap: Float[Tensor, "*batch"]
    """Distance from the action to the nearest proposal, in the action's units."""


def select(
    proposals: Float[Tensor, "*batch K A"],
    scene: Scene,
    rule: RuleName | Selector = "hcpg",
    *,
    noise: Float[Tensor, "*batch K"] | None = None,
    values: Float[Tensor, "*batch K"] | None = None,
) -> tuple[Float[Tensor, "*batch A"], Diagnostics]:
    """The action to execute out of K proposals, and how it came about.

    NumPy, JAX (also inside `jit` and `vmap`) and PyTorch arrays, float32 or float64, with any leading
    axes; the action comes back in the proposals' library, dtype and device. It lies within the proposals'
    element-wise range, then within the selector's bounds, [-1, 1] unless set otherwise.

    While JAX traces, numbers cannot be checked: a candidate with a number that is not finite (its own,
    its score's, its lot's or its value's) then gets weight 0, and where no candidate is left the action
    is NaN.

    Args:
        proposals: K candidate actions per set.
        scene: the geometry; the score reads its approach vector, task vector and contact flag.
        rule: a name out of `RULES`, or a `Selector` with settings of its own.
        noise: independent uniform numbers, for rules that draw lots (`Selector.needs_noise`).
        values: a critic's value of each proposal, for rules that rank by it (`Selector.needs_values`).

    Raises:
        TypeError: proposals that are no array, or are neither float32 nor float64.
        ValueError: an unknown rule, a shape that does not fit, a number that is not finite, or noise or
            values that the rule needs and that are missing.

    Source: paper, Algorithm 1.
    """
    selector = rule if isinstance(rule, Selector) else Selector(rule=rule)
    inputs = gather(proposals, scene, selector, noise, values)
    phase = contact_phase(inputs.approach, inputs.contact, selector.gate_radius_m)
    scores = _scores(inputs, phase, selector)
    usable = _usable(inputs, scores)
    evidence = Evidence(scores, usable, inputs.noise, inputs.values)
    weights = RULES[selector.rule].weigh(selector, evidence)
    action = blend(weights, inputs.proposals, usable, selector.bounds)
    spread, gap = _distances(inputs.proposals, action, usable)
    return action, Diagnostics(weights, scores, phase, spread, gap)


def _scores(inputs: Inputs, phase: Tensor, selector: Selector) -> Tensor:
    moves = inputs.proposals[..., slice(*selector.translation)]
    approach, task = _targets(inputs, selector)
    return score(moves, approach, task, phase, selector.action_penalty, selector.epsilon)


def _targets(inputs: Inputs, selector: Selector) -> tuple[Tensor, Tensor]:
    """The scene's two vectors, or what a control puts in their place; the phase keeps the scene's."""
    if selector.direction == "random":
        anywhere = random_direction(inputs.noise)
        return anywhere, anywhere
    sign = -1.0 if selector.direction == "opposed" else 1.0
    return sign * inputs.approach, sign * inputs.task


def _usable(inputs: Inputs, scores: Tensor) -> Bool[Tensor, "*batch K"]:
    xp = namespace(scores)
    usable = xp.all(xp.isfinite(inputs.proposals), axis=-1) & xp.isfinite(scores)
    for extra in (inputs.noise, inputs.values):
        usable = usable if extra is None else usable & xp.isfinite(extra)
    return usable


def _distances(
    proposals: Float[Tensor, "*batch K A"],
    action: Float[Tensor, "*batch A"],
    usable: Bool[Tensor, "*batch K"],
) -> tuple[Float[Tensor, "*batch"], Float[Tensor, "*batch"]]:
    """Spread and blend gap of the usable candidates; near the dtype's largest number they saturate."""
    xp = namespace(proposals)
    *batch, count, size = proposals.shape
    chosen = usable[..., None]
    points = xp.where(chosen, bounded(proposals, 16.0 * count * size), 0.0)
    left = xp.clip(xp.sum(xp.asarray(usable, dtype=points.dtype), axis=-1), 1.0, None)
    centre = xp.sum(points, axis=-2, keepdims=True) / left[..., None, None]
    offsets = xp.where(chosen, points - centre, 0.0)
    spread = length(xp.reshape(offsets, (*batch, count * size))) / xp.sqrt(left)
    reach = length(bounded(action, 16.0 * count * size)[..., None, :] - points)
    gap = xp.min(xp.where(usable, reach, float("inf")), axis=-1)
    return spread, gap
