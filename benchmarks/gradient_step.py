"""One gradient step of the CPU preset: share of a core's matrix-product rate, and three seeds on all cores.

Prints JSON. Operations are counted from the sizes: only matrix products, two per multiply-add.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from typing import Any

from hcpg.types import Spec

SINGLE_THREADED = "--xla_cpu_multi_thread_eigen=false"
SPEC = Spec(39, 4)
CHUNK = 6
UPDATES = 600
PRODUCTS = 1000


def operations(observation_size: int, action_size: int, batch: int, learner: Any) -> float:
    """Floating-point operations of the matrix products of one update, averaged over the policy delay.

    Hand count for SAC-Flow (crossq) with equal widths; a backward pass is one product for each weight and
    one for each input that has parameters before it.
    """
    hidden, flow_steps, delay = learner.critic_hidden_size, learner.flow_steps, learner.policy_delay
    inputs = observation_size + action_size
    critic_first, critic_rest = 2 * inputs * hidden, 2 * (hidden * hidden + hidden)
    critic = critic_first + critic_rest
    drive = 2 * observation_size * 2 * hidden
    step = 2 * action_size * 2 * hidden + 2 * 2 * hidden * action_size
    deviation_first, deviation_rest = (
        2 * observation_size * hidden,
        2 * (hidden * hidden + hidden * action_size),
    )
    flow = drive + flow_steps * step + deviation_first + deviation_rest
    critic_update = 2 * 2 * batch * (critic + critic + critic_rest) + batch * flow
    actor_backward = 2 * flow - deviation_first
    actor_update = batch * (flow + actor_backward) + batch * 2 * 2 * critic
    return critic_update + actor_update / delay


def prepared(batch: int) -> Callable[[int], float]:
    """A compiled learner; called with a number of updates it makes them and gives the seconds they took."""
    import jax
    from jax import numpy as jnp

    from hcpg import presets, registry
    from hcpg.loops import learning, replay
    from hcpg.loops.runs_axis import stack

    settings = presets.settings("metaworld/drawer-open")
    method = registry.method(settings.method).METHOD(settings.learner, SPEC)
    key = jax.random.key(0)
    states = stack([method.init(key)])
    memory = replay.create(1, 20_000, SPEC)
    filled = jax.tree.map(lambda leaf: jax.random.uniform(key, leaf.shape), memory.transitions)
    memory = memory._replace(transitions=filled, inserted=jnp.asarray(20_000))
    learn = learning.compiled(method, type(states), 1, CHUNK, batch)
    keys = jnp.stack([key])

    def run(updates: int) -> float:
        nonlocal states
        began = time.perf_counter()
        for _ in range(updates // CHUNK):
            states = jax.block_until_ready(learn(states, memory, keys, keys))[0]
        return time.perf_counter() - began

    run(CHUNK)
    return run


def product_rate(batch: int) -> float:
    """Operations per second of 2B x 256 x 256 matrix products, the critics' own shape."""
    import jax

    a = jax.random.normal(jax.random.key(0), (2 * batch, 256))
    b = jax.random.normal(jax.random.key(1), (256, 256))
    product = jax.jit(lambda a, b: a @ b)
    product(a, b).block_until_ready()
    began = time.perf_counter()
    for _ in range(PRODUCTS):
        product(a, b).block_until_ready()
    return PRODUCTS * 2 * (2 * batch) * 256 * 256 / (time.perf_counter() - began)


def main() -> None:
    """Say `ready`, wait for a line, measure, print JSON: the parent starts several at the same moment."""
    os.environ["XLA_FLAGS"] = SINGLE_THREADED
    from hcpg import presets

    settings = presets.settings("metaworld/drawer-open")
    learner, batch = settings.learner, settings.budget.batch_size
    run = prepared(batch)
    print("ready", flush=True)
    sys.stdin.readline()
    seconds = run(UPDATES)
    count = operations(*SPEC, batch, learner)
    rate = count * UPDATES / seconds
    print(
        json.dumps({"seconds": seconds, "operations": count, "rate": rate, "products": product_rate(batch)})
    )


if __name__ == "__main__":
    main()
