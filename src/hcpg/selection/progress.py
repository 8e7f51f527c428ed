"""How far a proposal moves in the direction that matters now.

Every function takes any finite input, however extreme, without overflow.
"""

from math import pi

from hcpg.selection.arrays import bounded, length, namespace
from hcpg.types import Float, Tensor


def directional_progress(
    translations: Float[Tensor, "*batch K 3"], target: Float[Tensor, "*batch 3"], epsilon: float
) -> Float[Tensor, "*batch K"]:
    """The part of each translation that points along `target`, in the translation's units.

    For a small step it is the rate at which the distance to the target shrinks (equation 6).

    Source: paper, equation (5).
    """
    xp = namespace(translations)
    # Dividing by the largest component first, target / max(norm, epsilon) needs no large square.
    target = bounded(target, 16.0)
    unit = xp.clip(xp.max(xp.abs(target), axis=-1, keepdims=True), epsilon, None)
    scaled = target / unit
    direction = scaled / xp.clip(length(scaled), 1.0, None)[..., None]
    return xp.sum(translations * direction[..., None, :], axis=-1)


def random_direction(lots: Float[Tensor, "*batch K"]) -> Float[Tensor, "*batch 3"]:
    """A unit vector: uniform over the sphere, given two or more independent lots, uniform in [0, 1]."""
    xp = namespace(lots)
    height = 2.0 * xp.clip(lots[..., 0], 0.0, 1.0) - 1.0
    around = 2.0 * pi * xp.clip(lots[..., -1], 0.0, 1.0)
    radius = xp.sqrt(1.0 - height**2)
    return xp.stack([radius * xp.cos(around), radius * xp.sin(around), height], axis=-1)


def contact_phase(
    approach: Float[Tensor, "*batch 3"], contact: Float[Tensor, "*batch"] | None, gate_radius_m: float
) -> Float[Tensor, "*batch"]:
    """0 before contact, 1 after it; a contact flag goes before the distance, and may lie between.

    Source: paper, equation (7).
    """
    xp = namespace(approach)
    if contact is not None:
        return xp.clip(contact, 0.0, 1.0)
    # Far is far: shortening a long vector to twice the radius cannot bring it inside.
    near = xp.clip(approach, -2 * gate_radius_m, 2 * gate_radius_m)
    distance = length(near)
    return xp.where(distance < gate_radius_m, xp.ones_like(distance), xp.zeros_like(distance))


def score(
    translations: Float[Tensor, "*batch K 3"],
    approach: Float[Tensor, "*batch 3"],
    task: Float[Tensor, "*batch 3"],
    phase: Float[Tensor, "*batch"],
    action_penalty: float,
    epsilon: float,
) -> Float[Tensor, "*batch K"]:
    """Progress in the phase that holds, less a small price for large moves; in the translation's units.

    A component beyond a 32nd of the dtype's largest number (less with the penalty) counts as that limit.

    Source: paper, equation (8).
    """
    moves = bounded(translations, 32.0 * (1.0 + action_penalty))
    after = phase[..., None]
    before_contact = directional_progress(moves, approach, epsilon)
    after_contact = directional_progress(moves, task, epsilon)
    return (1.0 - after) * before_contact + after * after_contact - action_penalty * length(moves)
