"""Points and directions of a scene, for the adapters that read them; one code for NumPy, JAX and PyTorch."""

from hcpg.selection.arrays import length, namespace
from hcpg.types import Bool, Float, Tensor


def moved(
    point: Float[Tensor, "*batch 3"],
    x: Tensor | float = 0.0,
    y: Tensor | float = 0.0,
    z: Tensor | float = 0.0,
) -> Float[Tensor, "*batch 3"]:
    """The point shifted along the world axes, m."""
    return namespace(point).stack([point[..., 0] + x, point[..., 1] + y, point[..., 2] + z], axis=-1)


def flat(vector: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch 3"]:
    """The vector's part in the plane of the table."""
    return moved(vector, z=-vector[..., 2])


def planar_distance(
    one: Float[Tensor, "*batch 3"], other: Float[Tensor, "*batch 3"]
) -> Float[Tensor, "*batch"]:
    """How far apart two points are seen from above, m."""
    return length(flat(one - other))


def funnel(
    tool: Float[Tensor, "*batch 3"], target: Float[Tensor, "*batch 3"], radius_m: float, height_m: float
) -> Float[Tensor, "*batch 3"]:
    """Where to go to arrive at `target` from above (from below where the height is negative).

    As long as the tool is more than `radius_m` away, seen from above, that is `height_m` above the target.
    """
    outside = flag(planar_distance(tool, target) > radius_m, target)
    return moved(target, z=height_m * outside)


def flag(condition: Bool[Tensor, "*batch"], like: Float[Tensor, "*batch N"]) -> Float[Tensor, "*batch"]:
    """1 where the condition holds, 0 elsewhere, in the dtype of `like`."""
    xp, first = namespace(like), like[..., 0]
    return xp.where(condition, xp.ones_like(first), xp.zeros_like(first))


def rotated(
    quaternion: Float[Tensor, "*batch 4"], vector: tuple[float, float, float]
) -> Float[Tensor, "*batch 3"]:
    """A vector of the object's own frame, in world axes; the quaternion's scalar comes last."""
    axis, scalar = quaternion[..., :3], quaternion[..., 3:]
    own = moved(0.0 * axis, *vector)
    turn = 2.0 * _cross(axis, own)
    return own + scalar * turn + _cross(axis, turn)


def _cross(one: Float[Tensor, "*batch 3"], other: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch 3"]:
    (x, y, z), (u, v, w) = ([each[..., axis] for axis in range(3)] for each in (one, other))
    return namespace(one).stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
