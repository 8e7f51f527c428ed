"""Proposals without a policy: what a selector alone makes of chance, the control that needs no training."""

import numpy as np

from hcpg.types import Float


def uniform(
    seed: int, size: int, observation: Float[np.ndarray, " O"], count: int, draw: int
) -> Float[np.ndarray, "K A"]:
    """`count` actions of `size` numbers, uniform in [-1, 1]; a function of the seed and the draw alone."""
    return np.random.default_rng([seed, draw]).uniform(-1.0, 1.0, (count, size))
