"""Time of one selection against one `propose` of K=4 proposals, both jitted; and of NumPy's selection."""

import json
import os
import time

CALLS = 2_000


def main() -> None:
    """Median-free means over many calls in one process, one core."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    import jax
    import numpy as np

    from hcpg import presets, registry
    from hcpg.selection import Scene, select
    from hcpg.types import Spec

    settings = presets.settings("metaworld/drawer-open")
    method = registry.method(settings.method).METHOD(settings.learner, Spec(39, 4))
    read_scene = registry.task(settings.task).adapters["paper"]
    key, observation = jax.random.key(0), jax.random.uniform(jax.random.key(1), (39,))
    state = method.init(key)
    propose = jax.jit(lambda state, key: method.propose(state, observation, key, 4))
    proposals = propose(state, key)
    both = jax.jit(
        lambda state, key: select(method.propose(state, observation, key, 4), read_scene(observation))[0]
    )
    alone, together = _microseconds(propose, state, key), _microseconds(both, state, key)
    alone = min(alone, _microseconds(propose, state, key))
    scene = Scene(*(None if part is None else np.asarray(part) for part in read_scene(observation)))
    numpy = _microseconds(lambda: select(np.asarray(proposals), scene))
    share = (together - alone) / alone
    print(json.dumps({"propose_us": alone, "with_selection_us": together, "share": share, "numpy_us": numpy}))


def _microseconds(call, *arguments) -> float:  # noqa: ANN001, ANN002
    import jax

    jax.block_until_ready(call(*arguments))
    began = time.perf_counter()
    for _ in range(CALLS):
        jax.block_until_ready(call(*arguments))
    return (time.perf_counter() - began) / CALLS * 1e6


if __name__ == "__main__":
    main()
