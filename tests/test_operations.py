"""The benchmark's count of operations, against counts by hand."""

import sys
from pathlib import Path

import jax
import pytest
from jax import numpy as jnp

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.operations import count

A, B = jnp.ones((8, 3)), jnp.ones((3, 5))


def test_a_product_takes_two_operations_per_multiply_add():
    assert count(lambda a, b: a @ b, A, B) == 2 * 8 * 3 * 5


def test_a_gradient_takes_one_product_per_factor():
    both = jax.grad(lambda a, b: (a @ b).sum(), argnums=(0, 1))
    assert count(both, A, B) == 3 * 2 * 8 * 3 * 5


def test_loops_count_every_time_and_jitted_parts_count_once():
    def loop(a, b):
        return jax.lax.scan(lambda carry, _: (carry, jax.jit(jnp.matmul)(a, b)), 0, length=7)[1]

    assert count(loop, A, B) == 7 * 240


def test_a_branch_counts_by_its_share():
    def sometimes(a, b):
        return jax.lax.cond(a[0, 0] > 0, lambda: a @ b, lambda: jnp.zeros((8, 5)))

    assert count(sometimes, A, B, branch_share=1 / 3) == pytest.approx(80)


def test_the_count_by_hand_of_the_flow_update_agrees():
    """Within 5 %: the trace still holds a few products whose result nobody uses."""
    from benchmarks import gradient_step

    from hcpg import presets, registry
    from hcpg.types import Batch

    settings = presets.settings("metaworld/drawer-open")
    method = registry.method(settings.method).METHOD(settings.learner, gradient_step.SPEC)
    sizes = ((256, 39), (256, 4), (256,), (256, 39), (256,))
    batch = Batch(*(jnp.zeros(size) for size in sizes))
    state = jax.eval_shape(method.init, jax.random.key(0))
    found = count(method.update, state, batch, jax.random.key(0), branch_share=1 / 3)
    assert found == pytest.approx(gradient_step.operations(39, 4, 256, settings.learner), rel=0.05)
