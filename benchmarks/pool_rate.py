"""Steps per second of the environment pool on all cores, against one bare environment in one loop."""

import json
import os
import time

import numpy as np

TASK = "metaworld/button-press"
SECONDS = 10.0


def bare_rate() -> float:
    """Steps per second of one environment without a pool."""
    from hcpg import registry

    task = registry.task(TASK)
    environment = registry.suite(task.suite).make(task, seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (task.horizon, 4)).astype(np.float32)
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        environment.reset(steps)
        for action in actions:
            environment.step(action)
        steps += task.horizon
    return steps / (time.perf_counter() - began)


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
    before = bare_rate()
    pooled = pool_rate(8 * cores, cores)
    bare = (before + bare_rate()) / 2
    print(json.dumps({"bare": bare, "pool": pooled, "cores": cores, "ratio": pooled / (cores * bare)}))


if __name__ == "__main__":
    main()
