"""Steps per second of the environment pool on all cores, against one bare environment in one loop.

Bare is the package's own class, and ours.
"""

import json
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

TASK = "metaworld/button-press"
SECONDS = 10.0


def bare_rate(environment: Any, begin: Callable[[int], object], horizon: int) -> float:
    """Steps per second of one environment without a pool."""
    actions = np.random.default_rng(0).uniform(-1, 1, (horizon, 4)).astype(np.float32)
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        begin(steps)
        for action in actions:
            environment.step(action)
        steps += horizon
    return steps / (time.perf_counter() - began)


def bare_rates() -> dict[str, float]:
    """Of the package's class, with start states of its own, and of ours."""
    import metaworld

    from hcpg import registry

    task = registry.task(TASK)
    ours = registry.suite(task.suite).make(task, seed=0)
    package = metaworld.ALL_V3_ENVIRONMENTS[task.env_id]()
    starts = metaworld.MT1(task.env_id, seed=0).train_tasks

    def begin(start: int) -> None:
        package.set_task(starts[start % len(starts)])
        package.reset()

    return {
        "package": bare_rate(package, begin, task.horizon),
        "bare": bare_rate(ours, ours.reset, task.horizon),
    }


def pool_rate(environments: int, workers: int) -> float:
    """Environment steps per second through the pool."""
    from hcpg.loops.pool import Pool

    generator = np.random.default_rng(0)
    with Pool(TASK, [0] * environments, workers=workers) as pool:
        starts = np.arange(environments)
        pool.reset(starts)
        ticks, began = 0, time.perf_counter()
        while time.perf_counter() - began < SECONDS:
            pool.send(generator.uniform(-1, 1, (environments, 4)).astype(np.float32), starts + ticks)
            pool.receive()
            ticks += 1
        return ticks * environments / (time.perf_counter() - began)


def main() -> None:
    """Measure bare, pool, bare: the mean of the two bare rates takes out a drift of the machine."""
    cores = len(os.sched_getaffinity(0))
    before = bare_rates()
    pooled = pool_rate(8 * cores, cores)
    after = bare_rates()
    means = {name: (before[name] + after[name]) / 2 for name in before}
    print(json.dumps({**means, "pool": pooled, "cores": cores}))


if __name__ == "__main__":
    main()
