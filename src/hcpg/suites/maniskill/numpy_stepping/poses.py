"""Rotations and poses of single bodies, in float32, with ManiSkill's own formulas in its own order.

A step feeds on these numbers, and a contact can make a difference of one bit grow. So every sum and product
here rounds where ManiSkill's tensors of one element round, and what comes out is equal bit for bit.
"""

from typing import Any

import numpy as np

Vector = tuple[np.float32, np.float32, np.float32]
Quaternion = tuple[np.float32, np.float32, np.float32, np.float32]
"""The scalar comes first."""
Pose = tuple[Vector, Quaternion]
"""Position in m, rotation."""

ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)


def read(pose: Any) -> Pose:
    """Position and rotation of one of SAPIEN's poses."""
    return tuple(pose.p), tuple(pose.q)


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """The vector turned by the rotation."""
    return _multiply(_multiply(rotation, (ZERO, *vector)), _conjugate(rotation))[1:]


def compose(outer: Pose, inner: Pose) -> Pose:
    """The pose `inner`, given in the frame `outer`, in the frame that `outer` is given in."""
    return add(outer[0], rotate(outer[1], inner[0])), turn(outer[1], inner[1])


def inverse(pose: Pose) -> Pose:
    """The pose of the frame that `pose` is given in, seen from `pose`."""
    (x, y, z), rotation = pose
    back = _conjugate(rotation)
    return rotate(back, (-x, -y, -z)), back


def add(one: Vector, other: Vector) -> Vector:
    """The sum of two vectors."""
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def turn(outer: Quaternion, inner: Quaternion) -> Quaternion:
    """Both rotations, `inner` first, with a scalar that is not negative."""
    w, x, y, z = _multiply(outer, inner)
    return (-w, -x, -y, -z) if w < 0 else (w, x, y, z)


def turned_y_axis(rotation: Quaternion) -> Vector:
    """The y axis after the rotation."""
    r, i, j, k = rotation
    scale = _two_over_square(rotation)
    return scale * (i * j - k * r), ONE - scale * (i * i + k * k), scale * (j * k + i * r)


def yaw(rotation: Quaternion) -> float:
    """The last angle of the rotation written as turns about x, then y, then z of the turned frame, rad."""
    r, i, j, k = rotation
    scale = _two_over_square(rotation)
    return float(np.arctan2(-scale * (i * j - k * r), ONE - scale * (j * j + k * k)))


def _multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def _conjugate(rotation: Quaternion) -> Quaternion:
    w, x, y, z = rotation
    return w, -x, -y, -z


def _two_over_square(rotation: Quaternion) -> np.float32:
    r, i, j, k = rotation
    return TWO / (r * r + i * i + j * j + k * k)
