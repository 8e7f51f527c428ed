"""Time of our step of ManiSkill's tasks against ManiSkill's own behind CPUGymWrapper: one core, one run.

Both go through the same episodes under the same uniformly random actions, in turn, so that a drift of the
machine reaches both; what counts is the processor's time. ManiSkill's wrapper for the time limit is left out,
which favours ManiSkill.
"""

import dataclasses
import importlib
import json
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

TASKS = ("push-cube", "pull-cube", "pick-cube", "poke-cube")
MODES = ("pd_ee_delta_pos", "pd_ee_delta_pose")
SEEDS, STEPS = 20, 50


class Driven(NamedTuple):
    """An environment, by what the measurement does with it."""

    reset: Callable[[int], Any]
    step: Callable[[np.ndarray], Any]
    row: Callable[[Any], np.ndarray]
    """Observation, reward and success of one answer, as one row."""


class Episode(NamedTuple):
    """What one episode took, and what it answered."""

    reset_s: float
    steps_s: float
    rows: np.ndarray


def both(name: str, mode: str) -> tuple[Driven, Driven, int]:
    """ManiSkill's own environment, wrapped, ours, and the size of an action."""
    from hcpg import registry
    from hcpg.suites.maniskill.building import build_simulation

    task = dataclasses.replace(registry.task(f"maniskill/{name}"), control=mode)
    ours = registry.suite("maniskill").make(task, seed=0)
    wrapper = importlib.import_module("mani_skill.utils.wrappers.gymnasium").CPUGymWrapper
    stock = wrapper(build_simulation(task.env_id, mode), ignore_terminations=True)
    return (
        Driven(
            lambda seed: stock.reset(seed=seed),
            stock.step,
            lambda answer: np.append(answer[0], (answer[1], answer[4]["success"])),
        ),
        Driven(
            ours.reset,
            ours.step,
            lambda answer: np.append(answer.observation, (answer.reward, answer.success)),
        ),
        stock.action_space.shape[0],
    )


def episode(environment: Driven, seed: int, actions: np.ndarray) -> Episode:
    """One episode, timed."""
    began = time.process_time()
    environment.reset(seed)
    started = time.process_time()
    answers = [environment.step(action) for action in actions]
    ended = time.process_time()
    return Episode(started - began, ended - started, np.array([environment.row(each) for each in answers]))


def measure(name: str, mode: str) -> dict[str, Any]:
    """Mean time of a step and of a reset of each, and the largest difference of any number they answered."""
    stock, ours, size = both(name, mode)
    actions = np.random.default_rng(0).uniform(-1, 1, (SEEDS, STEPS, size)).astype(np.float32)
    for environment in (stock, ours):
        episode(environment, 0, actions[0])
    pairs = [[episode(each, seed, actions[seed]) for each in (stock, ours)] for seed in range(SEEDS)]
    steps, resets = (
        np.mean([[getattr(each, field) for each in pair] for pair in pairs], axis=0) * 1e6
        for field in ("steps_s", "reset_s")
    )
    return {
        "task": name,
        "mode": mode,
        "stock_step_us": steps[0] / STEPS,
        "our_step_us": steps[1] / STEPS,
        "our_reset_us": resets[1],
        "ratio": steps[0] / steps[1],
        "episode_ratio": (steps[0] + resets[0]) / (steps[1] + resets[1]),
        "largest_difference": max(float(np.abs(one.rows - other.rows).max()) for one, other in pairs),
    }


def main() -> None:
    """Measure every task in both control modes, on one thread; print JSON."""
    importlib.import_module("torch").set_num_threads(1)
    print(json.dumps([measure(name, mode) for name in TASKS for mode in MODES]))


if __name__ == "__main__":
    main()
