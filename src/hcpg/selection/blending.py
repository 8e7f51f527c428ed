"""From scores to weights to one action inside the hull of the proposals.

`usable` marks the candidates that may be chosen: all of them, unless a number was not finite.
"""

from typing import Any

from hcpg.selection.arrays import bounded, namespace, ranks
from hcpg.types import Bool, Float, Tensor


def standardise(
    scores: Float[Tensor, "*batch K"], usable: Bool[Tensor, "*batch K"], epsilon: float
) -> Float[Tensor, "*batch K"]:
    """Scores in population standard deviations from the mean of their set; 0 where not usable.

    The result lies within plus and minus sqrt(K - 1).

    Source: paper, equation (9).
    """
    xp = namespace(scores)
    share = equal_weights(usable, scores.dtype)
    finite = bounded(xp.where(usable, scores, 0.0), 16.0)
    centred = xp.where(usable, finite - xp.sum(share * finite, axis=-1, keepdims=True), 0.0)
    # In units of the largest deviation the squares cannot overflow, and the quotient is the same.
    unit = xp.clip(xp.max(xp.abs(centred), axis=-1, keepdims=True), epsilon, None)
    centred = centred / unit
    deviation = xp.sqrt(xp.sum(share * centred**2, axis=-1, keepdims=True))
    return centred / xp.maximum(deviation, epsilon / unit)


def soft_weights(
    standardised: Float[Tensor, "*batch K"],
    usable: Bool[Tensor, "*batch K"],
    temperature: float,
    top_k: int | None = None,
) -> Float[Tensor, "*batch K"]:
    """Softmax over the usable candidates; the weights sum to 1.

    `top_k` keeps only that many best ones, an option that the paper leaves unused.

    Source: paper, equation (10).
    """
    xp = namespace(standardised)
    logits = xp.where(usable, standardised / temperature, -float("inf"))
    kept = usable if top_k is None else usable & (ranks(logits) < top_k)
    peak = xp.max(logits, axis=-1, keepdims=True)
    raised = xp.exp(xp.where(kept, logits - peak, -float("inf")))
    # The best candidate contributes exp(0), so the sum is below 1 only where no candidate is usable.
    return raised / xp.clip(xp.sum(raised, axis=-1, keepdims=True), 1.0, None)


def equal_weights(usable: Bool[Tensor, "*batch K"], dtype: Any) -> Float[Tensor, "*batch K"]:
    """The same weight for every usable candidate; they sum to 1."""
    xp = namespace(usable)
    chosen = xp.asarray(usable, dtype=dtype)
    return chosen / xp.clip(xp.sum(chosen, axis=-1, keepdims=True), 1.0, None)


def blend(
    weights: Float[Tensor, "*batch K"],
    proposals: Float[Tensor, "*batch K A"],
    usable: Bool[Tensor, "*batch K"],
    bounds: tuple[float, float] | None,
) -> Float[Tensor, "*batch A"]:
    """The weighted mean of the proposals, inside their element-wise range, clipped to `bounds`.

    NaN where no candidate is usable, so that a later look at the numbers stops it.

    Source: paper, equation (10).
    """
    xp = namespace(proposals)
    chosen = usable[..., None]
    low = xp.min(xp.where(chosen, proposals, float("inf")), axis=-2)
    high = xp.max(xp.where(chosen, proposals, -float("inf")), axis=-2)
    # Halves, because the rounded weights of the largest numbers may sum to more than the largest.
    halves = (0.5 * weights)[..., None] * xp.where(chosen, proposals, 0.0)
    half = xp.clip(xp.sum(halves, axis=-2), 0.5 * low, 0.5 * high)
    mean = xp.clip(2.0 * half, low, high)
    # Where all agree there is nothing to round; this also keeps the sign of a zero.
    action = xp.where(low == high, low, mean)
    action = action if bounds is None else xp.clip(action, *bounds)
    return xp.where(xp.any(chosen, axis=-2), action, float("nan"))
