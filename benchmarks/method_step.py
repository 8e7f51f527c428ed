"""One update of one preset at the CPU budget's sizes: seconds and operations, as JSON.

Usage: method_step.py PRESET.
"""

import json
import os
import sys
import time
from typing import Any

from hcpg.types import Batch, Spec

SPEC = Spec(39, 4)
UPDATES_PER_CALL = 6
CALLS = 30


def prepared(preset: str, updates_per_call: int) -> tuple[Any, tuple[Any, ...]]:
    """The compiled learner of a preset on a full replay, and what to call it with: states first."""
    import jax
    from jax import numpy as jnp

    from hcpg import presets, registry
    from hcpg.loops import learning, replay
    from hcpg.loops.runs_axis import stack

    settings = presets.settings("metaworld/drawer-open", preset)
    method = registry.method(settings.method).METHOD(settings.learner, SPEC)
    key = jax.random.key(0)
    state = method.init(key)
    memory = replay.create(1, 20_000, SPEC)
    filled = jax.tree.map(lambda leaf: jax.random.uniform(key, leaf.shape), memory.transitions)
    memory = memory._replace(transitions=filled, inserted=jnp.asarray(20_000))
    learn = learning.compiled(method, type(state), 1, updates_per_call, settings.budget.batch_size)
    keys = jnp.stack([key])
    return learn, (stack([state]), memory, keys, keys)


def operations(preset: str) -> float:
    """Floating-point operations of one update, averaged over the policy delay."""
    import jax

    from benchmarks.operations import count
    from hcpg import presets, registry

    settings = presets.settings("metaworld/drawer-open", preset)
    method = registry.method(settings.method).METHOD(settings.learner, SPEC)
    key, rows = jax.random.key(0), settings.budget.batch_size
    batch = Batch(*(jax.random.uniform(key, (rows, *shape)) for shape in ((39,), (4,), (), (39,), ())))
    share = 1 / getattr(settings.learner, "policy_delay", 1)
    return count(method.update, method.init(key), batch, key, branch_share=share)


def main() -> None:
    """Compile, warm up, then time many updates on one core."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    import jax

    counted = operations(sys.argv[1])
    learn, (states, *rest) = prepared(sys.argv[1], UPDATES_PER_CALL)
    print("ready", flush=True)
    sys.stdin.readline()
    for call in range(CALLS + 1):
        if call == 1:
            began = time.perf_counter()
        states = jax.block_until_ready(learn(states, *rest))[0]
    seconds = (time.perf_counter() - began) / (CALLS * UPDATES_PER_CALL)
    print(json.dumps({"seconds": seconds, "operations": counted}))


if __name__ == "__main__":
    main()
