"""A step of Meta-World 3.1.1 with the same numbers in three quarters of the time.

Physics, rewards and what a task says of its objects stay the package's. What changes is how a command gets
into MuJoCo and an observation out of it: bodies are looked up once, and an observation is written into one
array instead of being stacked from nine. Forces that bodies pass on, which nobody reads, are not computed.
"""

from collections.abc import Callable
from importlib import import_module
from math import sqrt
from typing import Any

import numpy as np

from hcpg.suites.metaworld.shared_model import simulated

UPRIGHT = (1.0, 0.0, 1.0, 0.0)
"""The hand's quaternion, as the package sets it."""
PER_OBJECT = 7
"""Numbers of an object in an observation: position and quaternion."""
FINGERS_APART_M = 0.1
"""What counts as an open gripper."""


class Views:
    """The places in MuJoCo's data that every step reads and writes."""

    def __init__(self, data: Any) -> None:
        self.hand, self.right, self.left = (
            data.body(name).xpos for name in ("hand", "rightclaw", "leftclaw")
        )
        self.target, self.turn, self.control = data.mocap_pos[0], data.mocap_quat[0], data.ctrl


def step(simulation: Any, action: np.ndarray) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
    """The package's `step`.

    Raises:
        ValueError: the episode is over.
    """
    if simulation.curr_path_length >= simulation.max_path_length:
        raise ValueError("the episode is over: reset the environment first")
    mujoco: Any = import_module("mujoco")
    views = simulation.views
    # In the action's own precision first, as the package has it.
    delta = np.minimum(np.maximum(action[:3], -1), 1) * simulation.action_scale
    np.minimum(
        np.maximum(views.target + delta, simulation.mocap_low), simulation.mocap_high, out=views.target
    )
    views.turn[:] = UPRIGHT
    views.control[:] = action[-1], -action[-1]
    mujoco.mj_step(simulation.model, simulation.data, nstep=simulation.frame_skip)
    simulation.curr_path_length += 1
    for name, place in simulation._target_site_config:
        simulation.data.site(name).xpos = place[:3]
    mujoco.mj_forward(simulation.model, simulation.data)
    space = simulation.sawyer_observation_space
    observation = np.minimum(np.maximum(simulation._get_obs(), space.low), space.high)
    reward, info = simulation.evaluate_state(observation, action)
    return observation, reward, False, simulation.curr_path_length == simulation.max_path_length, info


def observe(simulation: Any) -> np.ndarray:
    """The package's `_get_obs`: now, a step before, goal; [39]."""
    now = simulation._get_curr_obs_combined_no_goal()
    observation = np.zeros(2 * len(now) + 3)
    observation[: len(now)] = now
    observation[len(now) : -3] = simulation._prev_obs
    if not simulation._partially_observable:
        observation[-3:] = simulation._get_pos_goal()
    simulation._prev_obs = now
    return observation


def observe_now(simulation: Any) -> np.ndarray:
    """The package's `_get_curr_obs_combined_no_goal`: hand, opening, objects; [18]."""
    views, observation = simulation.views, np.zeros(4 + simulation._obs_obj_max_len)
    apart = views.right - views.left
    observation[:3] = views.hand
    observation[3] = min(max(sqrt(apart.dot(apart)) / FINGERS_APART_M, 0.0), 1.0)
    places, turns = simulation._get_pos_objects(), simulation._get_quat_objects()
    for each in range(len(places) // 3):
        first = 4 + PER_OBJECT * each
        observation[first : first + 3] = places[3 * each : 3 * each + 3]
        observation[first + 3 : first + PER_OBJECT] = turns[4 * each : 4 * each + 4]
    return observation


def simulation_class(stock: type, **attributes: Any) -> Callable[[], Any]:
    """A class of the package that steps like this, on a shared model, with `attributes` replaced.

    What is replaced here is the package's for all tasks: none has a version of its own.
    """

    def initialize(simulation: Any) -> tuple[Any, Any]:
        simulation.shared, data = simulated(stock, simulation)
        simulation.views = Views(data)
        return simulation.shared.model, data

    replaced = {
        "_initialize_simulation": initialize,
        "step": step,
        "_get_obs": observe,
        "_get_curr_obs_combined_no_goal": observe_now,
    }
    return type(stock.__name__, (stock,), replaced | attributes)
