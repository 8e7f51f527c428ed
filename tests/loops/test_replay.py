"""The ring of transitions against a plain list, its sampling by counting, the actions a resume repeats."""

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from jax import numpy as jnp

from hcpg.loops import replay
from hcpg.types import Batch, Sampling, Spec

SPEC = Spec(observation_size=2, action_size=1)
RUNS, CAPACITY = 2, 6
UNIFORM, RECENT = Sampling(), Sampling(recent_share=0.2, recent_window=2048)
insert = jax.jit(replay.insert)


def arrivals(first, brought):
    """Rows numbered from `first` in run 0, and from 1000 + `first` in run 1."""
    number = np.arange(first, first + brought, dtype=np.float32) + np.array([[0.0], [1000.0]], np.float32)
    wide = np.stack([number, -number], axis=-1)
    return Batch(wide, number[..., None], number, wide + 0.5, (number % 2).astype(np.float32))


def filled(insertions, brought):
    memory = replay.create(RUNS, CAPACITY, SPEC)
    for index in range(insertions):
        memory = insert(memory, arrivals(index * brought, brought))
    return memory


@given(brought=st.sampled_from([1, 2, 3]), insertions=st.integers(0, 14))
@hypothesis_settings(max_examples=25)
def test_it_holds_the_newest_rows_in_ring_order(brought, insertions):
    model = []  # a list that overwrites its oldest entry once it is full
    for number in range(insertions * brought):
        model[number % CAPACITY : number % CAPACITY + 1] = [number]
    memory = filled(insertions, brought)
    assert int(memory.inserted) == insertions * brought
    for run in range(RUNS):
        part = replay.filled_part(memory, run)
        expected = np.array(model) + 1000 * run
        np.testing.assert_array_equal(part["rewards"], expected)
        np.testing.assert_array_equal(part["observations"], np.stack([expected, -expected], axis=-1))
        np.testing.assert_array_equal(part["next_observations"][:, 0], expected + 0.5)
        np.testing.assert_array_equal(part["actions"][:, 0], expected)
        np.testing.assert_array_equal(part["terminated"], expected % 2)


def test_four_and_a_half_rings_leave_the_last_six_rows():
    rows = replay.filled_part(filled(9, 3), 0)["rewards"]
    assert rows.tolist() == [24, 25, 26, 21, 22, 23]  # 27 rows: 24 to 26 stand where the ring began anew


def rows_of(memory):
    return jax.tree.map(lambda ring: ring[0], memory.transitions), memory.inserted


def draw(memory, size, sampling=UNIFORM, seed=0):
    return replay.sample(*rows_of(memory), jax.random.key(seed), size, sampling)


def test_a_sample_is_uniform_over_what_is_filled():
    batch = draw(filled(2, 2), 8000)
    counts = np.bincount(np.asarray(batch.rewards, int), minlength=CAPACITY)
    assert counts[4:].sum() == 0  # the two rows never written
    assert np.abs(counts[:4] - 2000).max() < 4 * np.sqrt(8000 * 0.25 * 0.75)


def test_a_sampled_row_keeps_its_parts_together():
    batch = draw(filled(9, 3), 100)
    assert set(batch.rewards.tolist()) == {21, 22, 23, 24, 25, 26}
    np.testing.assert_array_equal(batch.actions[:, 0], batch.rewards)
    np.testing.assert_array_equal(batch.next_observations[:, 0], batch.rewards + 0.5)


def test_uniform_sampling_draws_the_rows_it_always_drew():
    """Bit for bit, so that no result of a method that wants nothing else changes."""
    memory, key = filled(9, 3), jax.random.key(7)
    rows = jax.random.randint(key, (100,), 0, CAPACITY)
    expected = memory.transitions.rewards[0][rows]
    np.testing.assert_array_equal(draw(memory, 100, UNIFORM, seed=7).rewards, expected)
    windowed = Sampling(recent_share=0.0, recent_window=1)
    np.testing.assert_array_equal(draw(memory, 100, windowed, seed=7).rewards, expected)


@pytest.fixture(scope="module")
def wrapped():
    """A ring of 5000 after 6000 rows: the next goes to position 1000, in the middle of the newest 2048."""
    memory = replay.create(RUNS, 5000, SPEC)
    for index in range(60):
        memory = insert(memory, arrivals(index * 100, 100))
    assert int(memory.inserted % 5000) == 1000
    return memory


def test_the_recent_rows_are_the_last_2048_also_across_the_wrap(wrapped):
    drawn = np.asarray(draw(wrapped, 40_000, Sampling(1.0, 2048)).rewards, int)
    seen, counts = np.unique(drawn, return_counts=True)
    assert seen.tolist() == list(range(3952, 6000))
    assert counts.max() < 19.6 + 6 * np.sqrt(19.6)  # 40000 / 2048 = 19.5 each


def test_a_fifth_of_the_batch_is_recent_and_the_rest_is_uniform(wrapped):
    batches = jax.vmap(lambda key: replay.sample(*rows_of(wrapped), key, 256, RECENT).rewards)
    drawn = np.asarray(batches(jax.random.split(jax.random.key(0), 200)), int)
    assert drawn.shape == (200, 256)
    assert drawn[:, 205:].min() >= 3952  # 51 of 256
    uniform = drawn[:, :205].ravel()
    assert 1000 <= uniform.min() < 1010
    counts = np.bincount((uniform - 1000) // 1000, minlength=5)
    assert np.abs(counts - 8200).max() < 4 * np.sqrt(41_000 * 0.2 * 0.8)
    assert abs(np.corrcoef(drawn[:, 0], drawn[:, 205])[0, 1]) < 4 / np.sqrt(200)


def test_repeated_rows_are_as_rare_as_said(wrapped):
    """Of n rows out of N, n - N (1 - (1 - 1/N)^n) repeat another: 0.617 of 51, 4.12 of 205."""
    batches = jax.vmap(lambda key: replay.sample(*rows_of(wrapped), key, 256, RECENT).rewards)
    drawn = np.sort(batches(jax.random.split(jax.random.key(1), 2000)).reshape(2000, 256)[:, 205:])
    repeats = (np.diff(drawn) == 0).sum(axis=1)
    np.testing.assert_allclose(repeats.mean(), 0.617, atol=4 * np.sqrt(0.617 / 2000))


def test_until_the_window_is_full_recent_rows_are_all_there_are():
    counts = np.bincount(
        np.asarray(draw(filled(2, 2), 8000, Sampling(1.0, 5)).rewards, int), minlength=CAPACITY
    )
    assert counts[4:].sum() == 0  # the two rows never written
    assert np.abs(counts[:4] - 2000).max() < 4 * np.sqrt(8000 * 0.25 * 0.75)


def test_a_window_larger_than_the_ring_is_the_ring():
    assert set(draw(filled(9, 3), 200, Sampling(1.0, 100)).rewards.tolist()) == {21, 22, 23, 24, 25, 26}
    assert set(draw(filled(9, 3), 200, Sampling(1.0, 2)).rewards.tolist()) == {25, 26}


def test_a_recent_row_keeps_its_parts_together():
    batch = draw(filled(9, 3), 100, Sampling(0.5, 4))
    np.testing.assert_array_equal(batch.actions[:, 0], batch.rewards)
    np.testing.assert_array_equal(batch.next_observations[:, 0], batch.rewards + 0.5)
    assert set(batch.rewards[50:].tolist()) == {23, 24, 25, 26}
    assert set(batch.rewards[:50].tolist()) == {21, 22, 23, 24, 25, 26}


def test_a_refilled_ring_goes_on_as_the_old_one_would():
    for insertions in (2, 9):
        old = filled(insertions, 2)
        parts = [replay.filled_part(old, run) for run in range(RUNS)]
        new = replay.refill(replay.create(RUNS, CAPACITY, SPEC), parts, int(old.inserted))
        one, other = (insert(memory, arrivals(500, 2)) for memory in (old, new))
        jax.tree.map(np.testing.assert_array_equal, one, other)


def test_the_actions_since_an_episodes_start_are_found_across_the_wrap():
    part = replay.filled_part(filled(5, 2), 0)  # rows 0 to 9 in a ring of 6: [6, 7, 8, 9, 4, 5]
    found = replay.last_actions(part, inserted=10, environments=2, ages=np.array([2, 3]))
    assert found[0].ravel().tolist() == [6, 8]  # environment 0 got the even rows
    assert found[1].ravel().tolist() == [5, 7, 9]


def test_the_actions_since_an_episodes_start_are_found_before_the_wrap():
    part = replay.filled_part(filled(2, 2), 0)
    found = replay.last_actions(part, inserted=4, environments=2, ages=np.array([0, 2]))
    assert found[0].shape == (0, 1)
    assert found[1].ravel().tolist() == [1, 3]


def test_an_empty_ring_has_the_spec_sizes():
    memory = replay.create(3, 10, Spec(7, 2))
    shapes = [leaf.shape for leaf in memory.transitions]
    assert shapes == [(3, 10, 7), (3, 10, 2), (3, 10), (3, 10, 7), (3, 10)]
    assert memory.inserted == jnp.int32(0)
