"""No finite input, however extreme, gives NaN, infinity, a warning, or an action outside the hull."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hcpg.selection import RULES, Scene, Selector, select

COUNT, SIZE = 4, 5


@st.composite
def problems(draw, dtype, subnormal=True, count=None):
    """Proposals, scene, noise and values of any finite numbers."""
    width = np.dtype(dtype).itemsize * 8
    finite = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=subnormal, width=width)
    largest = float(np.finfo(dtype).max)
    numbers = st.one_of(finite, st.sampled_from([0.0, 1.0, largest, -largest, float(np.finfo(dtype).tiny)]))
    chosen = count or draw(st.integers(1, 6))

    def some(*shape):
        return draw(arrays(dtype, shape, elements=numbers))

    contact = draw(st.sampled_from([None, some()]))
    scene = Scene(some(3), some(3), some(3), some(3), some(3), contact)
    return some(chosen, SIZE), scene, some(chosen), some(chosen)


def check(proposals, action, seen, bounds=(-np.inf, np.inf)):
    for part in (action, *seen):
        assert np.isfinite(np.asarray(part)).all()
    assert (np.asarray(action) >= np.clip(proposals.min(axis=0), *bounds)).all()
    assert (np.asarray(action) <= np.clip(proposals.max(axis=0), *bounds)).all()
    assert np.asarray(seen.weights).sum() == pytest.approx(1.0, abs=1e-5)
    assert (np.asarray(seen.weights) >= 0).all()


SELECTORS = st.builds(
    Selector,
    rule=st.sampled_from(list(RULES)),
    direction=st.sampled_from(["scene", "opposed", "random"]),
    temperature=st.sampled_from([1e-6, 0.7, 1e6]),
    action_penalty=st.sampled_from([0.0, 0.05, 1e6]),
    epsilon=st.sampled_from([1e-30, 1e-6, 1.0]),
    gate_radius_m=st.sampled_from([0.0, 0.08, 1e6]),
    top_k=st.sampled_from([None, 1, 2]),
    bounds=st.sampled_from([None, (-1.0, 1.0)]),
)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@settings(deadline=None, max_examples=120)
@given(data=st.data())
def test_numpy(dtype, data):
    proposals, scene, noise, values = data.draw(problems(dtype))
    selector = data.draw(SELECTORS)
    action, seen = select(proposals, scene, selector, noise=noise, values=values)
    check(proposals, action, seen, selector.bounds or (-np.inf, np.inf))


@settings(deadline=None, max_examples=60)
@given(problem=problems(np.float32), selector=SELECTORS)
def test_pytorch(problem, selector):
    proposals, scene, noise, values = jax.tree.map(torch.asarray, problem)
    action, seen = select(proposals, scene, selector, noise=noise, values=values)
    check(problem[0], action, seen, selector.bounds or (-np.inf, np.inf))


@jax.jit
def every_rule(proposals, scene, noise, values):
    selectors = [Selector(rule=rule, bounds=None) for rule in RULES]
    return [select(proposals, scene, selector, noise=noise, values=values) for selector in selectors]


@settings(deadline=None, max_examples=60)
@given(problem=problems(np.float32, subnormal=False, count=COUNT))
def test_jax_compiled(problem):
    # XLA treats subnormal numbers as 0 on a CPU, so none are given.
    for action, seen in every_rule(*jax.tree.map(jnp.asarray, problem)):
        check(problem[0], action, seen)


LARGEST = np.finfo(np.float32).max
REMOTE = Scene.of(np.zeros(3, np.float32), np.array([LARGEST, 0, 0], np.float32), np.zeros(3, np.float32))
MOVES = np.array([[0.5, 0, 0, 0, 0], [-0.5, 0, 0, 0, 0], [0, 0.5, 0, 0, 0], [0, 0, 0.5, 0, 0]], np.float32)


@pytest.mark.parametrize("convert", [np.asarray, jnp.asarray, torch.asarray])
def test_the_largest_numbers_keep_their_meaning(convert):
    scene = jax.tree.map(convert, REMOTE)
    values = convert(np.array([LARGEST, -LARGEST, -LARGEST, -LARGEST]))
    compiled = jax.jit(select, static_argnums=2) if convert is jnp.asarray else select
    _, seen = compiled(convert(MOVES), scene, Selector(rule="value_soft"), values=values)
    assert np.asarray(seen.scores) == pytest.approx([0.475, -0.525, -0.025, -0.025])
    # One outlier of four weighs at most this.
    assert float(seen.weights[0]) == pytest.approx(1 / (1 + 3 * np.exp(-(3**0.5 + 3**-0.5) / 0.7)), abs=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_opposite_extremes(dtype):
    largest = np.finfo(dtype).max
    proposals = np.array([[largest] * 3, [-largest] * 3, [largest, -largest, 0.0]], dtype)
    scene = Scene.of(np.zeros(3, dtype), np.full(3, largest, dtype), np.zeros(3, dtype))
    action, seen = select(proposals, scene, Selector(bounds=None))
    check(proposals, action, seen)
    assert np.argmax(seen.weights) == 0
