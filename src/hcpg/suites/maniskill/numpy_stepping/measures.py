"""Distances between points in NumPy's float32, and what ManiSkill's rewards make of them."""

import math

import numpy as np

from hcpg.types import Float


def distance(one: Float[np.ndarray, " 3"], other: Float[np.ndarray, " 3"]) -> float:
    """How far apart two points are, m."""
    return math.hypot(*(one - other).tolist())


def planar_distance(one: Float[np.ndarray, " 3"], other: Float[np.ndarray, " 3"]) -> float:
    """How far apart two points are, seen from above, m."""
    return math.hypot(*(one - other)[:2].tolist())


def closeness(gap: float) -> float:
    """1 where the gap is closed, towards 0 with distance; a fifth of a metre (or radian) leaves 0.24."""
    return 1 - math.tanh(5 * gap)
