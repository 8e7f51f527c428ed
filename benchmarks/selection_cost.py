"""Time of one selection against one `propose` of K=4 proposals, both jitted; and of NumPy's selection.

For one environment, and for the eight that a training tick serves with one call.
"""

import json
import os
import time
from collections.abc import Callable
from typing import Any

CALLS, ENVIRONMENTS = 500, 8


def main() -> None:
    """Measure on one core; print JSON."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    import jax
    import numpy as np
    from jax import numpy as jnp

    from hcpg import presets, registry
    from hcpg.selection import Scene, select
    from hcpg.types import Spec

    settings = presets.settings("metaworld/drawer-open")
    method = registry.method(settings.method).METHOD(settings.learner, Spec(39, 4))
    read_scene = registry.task(settings.task).adapters["paper"]
    key, observation = jax.random.key(0), jax.random.uniform(jax.random.key(1), (39,))
    state = method.init(key)

    def propose(state: Any, key: Any, observation: Any) -> Any:
        return method.propose(state, observation, key, 4)

    def both(state: Any, key: Any, observation: Any) -> Any:
        return select(propose(state, key, observation), read_scene(observation))[0]

    proposals = propose(state, key, observation)
    alone, together = _pair(jax.jit(propose), jax.jit(both), state, key, observation)
    many = jax.random.split(key, ENVIRONMENTS), jnp.tile(observation, (ENVIRONMENTS, 1))
    batched = [jax.jit(jax.vmap(each, in_axes=(None, 0, 0))) for each in (propose, both)]
    alone_8, together_8 = _pair(*batched, state, *many)
    scene = Scene(*(None if part is None else np.asarray(part) for part in read_scene(observation)))
    numpy = _microseconds(lambda: select(np.asarray(proposals), scene))
    answer = {"propose_us": alone, "with_selection_us": together, "share": together / alone - 1}
    answer |= {"share_of_a_tick": together_8 / alone_8 - 1, "numpy_us": numpy}
    print(json.dumps(answer))


def _pair(first: Callable, second: Callable, *arguments: Any) -> tuple[float, float]:
    """The fastest of five rounds of each, in turn: what disturbs one round does not decide."""
    rounds = [(_microseconds(first, *arguments), _microseconds(second, *arguments)) for _ in range(5)]
    return min(one for one, _ in rounds), min(other for _, other in rounds)


def _microseconds(call: Callable, *arguments: Any) -> float:
    import jax

    jax.block_until_ready(call(*arguments))
    began = time.perf_counter()
    for _ in range(CALLS):
        jax.block_until_ready(call(*arguments))
    return (time.perf_counter() - began) / CALLS * 1e6


if __name__ == "__main__":
    main()
