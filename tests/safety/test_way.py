"""The way to a start: up, across, down, in steps of one length."""

import numpy as np

from hcpg.safety.way import ARRIVED_M, Way


def followed(start, goal, share=0.4, step_m=0.01):
    """The positions of an arm that covers a share of each step."""
    way, position, seen = Way(np.array(start), np.array(goal), step_m), np.array(start), []
    while (target := way.target(position)) is not None:
        assert abs(np.linalg.norm(target - position) - step_m) < 1e-9
        position = position + share * (target - position)
        seen.append(position)
        assert len(seen) < 1000
    return np.array(seen)


def test_it_goes_up_before_it_goes_across_and_across_before_it_goes_down():
    seen = followed([0.5, 0.0, 0.05], [0.4, 0.1, 0.15])
    assert np.linalg.norm(seen[-1] - [0.4, 0.1, 0.15]) < ARRIVED_M
    aside = np.linalg.norm(seen[:, :2] - [0.5, 0.0], axis=1)
    assert (seen[aside > 0.005, 2] > 0.13).all()


def test_from_above_it_goes_across_first():
    seen = followed([0.5, 0.0, 0.30], [0.4, 0.0, 0.10])
    away = np.abs(seen[:, 0] - 0.4)
    assert (seen[away > 0.015, 2] > 0.28).all()


def test_whoever_is_there_has_arrived():
    here = np.array([0.4, 0.0, 0.2])
    assert Way(here, here, 0.01).target(np.array([0.401, 0.0, 0.2])) is None
