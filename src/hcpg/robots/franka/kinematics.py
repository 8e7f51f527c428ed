"""The FR3's forward kinematics from the manufacturer's table: a second opinion on the reported pose."""

import numpy as np

from hcpg.types import Float

JOINTS = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
]
"""a, d (m) and alpha (rad) of the modified Denavit-Hartenberg convention, joints 1 to 7."""
FLANGE_M = 0.107
JOINT_LIMITS = np.array(
    [
        (-2.7437, 2.7437),
        (-1.7837, 1.7837),
        (-2.9007, 2.9007),
        (-3.0421, -0.1518),
        (-2.8065, 2.8065),
        (0.5445, 4.5169),
        (-3.0159, 3.0159),
    ]
)
"""Lowest and highest angle of each joint, rad."""


def joint_frames(angles: Float[np.ndarray, " 7"]) -> list[Float[np.ndarray, "4 4"]]:
    """The frame of each joint in the base frame; the last is the seventh link's."""
    pose, frames = np.eye(4), []
    for (a, d, alpha), angle in zip(JOINTS, angles, strict=True):
        pose = pose @ _link(a, d, alpha, angle)
        frames.append(pose)
    return frames


def flange_pose(angles: Float[np.ndarray, " 7"]) -> Float[np.ndarray, "4 4"]:
    """The flange in the base frame."""
    forward = np.eye(4)
    forward[2, 3] = FLANGE_M
    return joint_frames(angles)[-1] @ forward


def point_velocity(
    angles: Float[np.ndarray, " 7"], speeds: Float[np.ndarray, " 7"], point: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 3"]:
    """Of a point that the hand carries, m/s: each joint turns it about its own axis."""
    frames = joint_frames(angles)
    turns = [np.cross(frame[:3, 2], point - frame[:3, 3]) for frame in frames]
    return np.array(turns).T @ speeds


def _link(a: float, d: float, alpha: float, angle: float) -> Float[np.ndarray, "4 4"]:
    cos, sin, cos_a, sin_a = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [cos, -sin, 0.0, a],
            [sin * cos_a, cos * cos_a, -sin_a, -d * sin_a],
            [sin * sin_a, cos * sin_a, cos_a, d * cos_a],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
