"""An episode by hand: the tool walks along x to the object, then both walk on to the goal."""

import numpy as np

from hcpg.report.rollouts import Moment, Rollout, Thought
from hcpg.types import Scene


def thought(tick):
    tool = np.array([0.1 * tick, 0.0, 0.1])
    thing = np.array([max(0.3, 0.1 * tick), 0.0, 0.0])
    scene = Scene.of(tool, thing, np.array([0.5, 0.1, 0.0]), None)
    proposals = np.array([[1.0, 0, 0, 0.5], [0.5, 0.5, 0, 0], [0, -1.0, 0, 0], [-1.0, 0, 0, -1]])
    return Thought(
        proposals,
        np.array([0.6, 0.3, 0.06, 0.04]),
        np.array([0.9, 0.4, 0.0, -1.0]),
        scene,
        float(tick >= 3),
        0.7,
        0.2,
    )


def rollout(success_tick=4, length=6, size=(8, 12), selects=True):
    moments = [
        Moment(
            tick,
            np.full((*size, 3), 5 * tick, np.uint8),
            thought(tick) if selects else None,
            np.array([0.7, 0.1, 0.0, 0.2], np.float32),
            0.1 * tick,
            success_tick is not None and tick >= success_tick,
        )
        for tick in range(length)
    ]
    return Rollout("metaworld/drawer-open", "hcpg_flow", 1, 5000, "hcpg", 3, (0, 3), moments)
