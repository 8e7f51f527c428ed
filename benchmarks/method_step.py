"""One update of one preset at the CPU budget's sizes: seconds and operations, as JSON.

Usage: method_step.py PRESET.
"""

import json
import os
import sys
import time

UPDATES_PER_CALL = 6
CALLS = 30


def main() -> None:
    """Compile, warm up, then time many updates on one core."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    import jax
    from jax import numpy as jnp

    from benchmarks.operations import count
    from hcpg import presets, registry
    from hcpg.loops import learning, replay
    from hcpg.loops.runs_axis import stack
    from hcpg.types import Spec

    spec = Spec(39, 4)
    settings = presets.settings("metaworld/drawer-open", sys.argv[1])
    method = registry.method(settings.method).METHOD(settings.learner, spec)
    key, batch_size = jax.random.key(0), settings.budget.batch_size
    state = method.init(key)
    memory = replay.create(1, 20_000, spec)
    filled = jax.tree.map(lambda leaf: jax.random.uniform(key, leaf.shape), memory.transitions)
    memory = memory._replace(transitions=filled, inserted=jnp.asarray(20_000))
    batch = jax.tree.map(lambda leaf: leaf[0, :batch_size], filled)
    share = 1 / getattr(settings.learner, "policy_delay", 1)
    operations = count(method.update, state, batch, key, branch_share=share)
    learn = learning.compiled(method, type(state), 1, UPDATES_PER_CALL, batch_size)
    states, keys = stack([state]), jnp.stack([key])
    print("ready", flush=True)
    sys.stdin.readline()
    for call in range(CALLS + 1):
        if call == 1:
            began = time.perf_counter()
        states = jax.block_until_ready(learn(states, memory, keys, keys))[0]
    seconds = (time.perf_counter() - began) / (CALLS * UPDATES_PER_CALL)
    print(json.dumps({"seconds": seconds, "operations": operations}))


if __name__ == "__main__":
    main()
