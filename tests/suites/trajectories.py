"""Rows to compare trajectories by, of any environment with four action dimensions."""

import numpy as np


def actions_of(seed, count):
    """Uniform ones."""
    return np.random.default_rng(seed).uniform(-1, 1, (count, 4)).astype(np.float32)


def trajectory(environment, start, actions):
    """A row for the reset and for each action: observation, reward, success."""
    rows = [np.append(environment.reset(start), [0.0, 0.0])]
    for action in actions:
        step = environment.step(action)
        rows.append(np.append(step.observation, [step.reward, step.success]))
    return np.asarray(rows)
