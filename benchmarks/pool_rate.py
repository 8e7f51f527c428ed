"""Steps per second of the environment pool on all cores, against one bare environment in one loop.

Bare is the package's own class, and ours. A machine's speed may change from one minute to the next, so all
three take turns, and ratios are medians over the turns.
"""

import json
import os
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

TASK = "metaworld/button-press"
TURNS, SECONDS = 7, 2.0


def rate(step: Callable[[int], int]) -> float:
    """Environment steps per second; `step` takes the number of steps so far and says how many it made."""
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        steps += step(steps)
    return steps / (time.perf_counter() - began)


def bare(environment: Any, begin: Callable[[int], object], horizon: int) -> Callable[[int], int]:
    """Steps of one environment without a pool, an episode at a time: its reset counts as time."""
    actions = np.random.default_rng(0).uniform(-1, 1, (horizon, 4)).astype(np.float32)

    def step(done: int) -> int:
        if done % horizon == 0:
            begin(done // horizon)
        environment.step(actions[done % horizon])
        return 1

    return step


def pooled(pool: Any) -> Callable[[int], int]:
    """Ticks of all environments of a pool, which reset themselves."""
    generator, starts = np.random.default_rng(0), np.arange(pool.size)
    pool.reset(starts)

    def step(done: int) -> int:
        pool.send(generator.uniform(-1, 1, (pool.size, 4)).astype(np.float32), starts + done)
        pool.receive()
        return pool.size

    return step


def main() -> None:
    """All three in turn; print JSON."""
    import metaworld

    from hcpg import registry
    from hcpg.loops.pool import Pool

    task, cores = registry.task(TASK), len(os.sched_getaffinity(0))
    ours = registry.suite(task.suite).make(task, seed=0)
    package = metaworld.ALL_V3_ENVIRONMENTS[task.env_id]()
    starts = metaworld.MT1(task.env_id, seed=0).train_tasks

    def begin(episode: int) -> None:
        package.set_task(starts[episode % len(starts)])
        package.reset()

    with Pool(TASK, [0] * (8 * cores), workers=cores) as pool:
        steps = {
            "package": bare(package, begin, task.horizon),
            "ours": bare(ours, ours.reset, task.horizon),
            "pool": pooled(pool),
        }
        turns = [{name: rate(step) for name, step in steps.items()} for _ in range(TURNS)]
    medians = {name: median(turn[name] for turn in turns) for name in steps}
    ratios = {
        f"pool_to_{name}": median(turn["pool"] / (cores * turn[name]) for turn in turns)
        for name in ("package", "ours")
    }
    quicker = median(turn["ours"] / turn["package"] for turn in turns)
    print(json.dumps({**medians, **ratios, "quicker": quicker, "cores": cores}))


if __name__ == "__main__":
    main()
