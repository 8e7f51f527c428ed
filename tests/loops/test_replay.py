"""The ring of transitions against a plain list, its sampling by counting, the actions a resume repeats."""

import jax
import numpy as np
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from jax import numpy as jnp

from hcpg.loops import replay
from hcpg.types import Batch, Spec

SPEC = Spec(observation_size=2, action_size=1)
RUNS, CAPACITY = 2, 6
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


def draw(memory, size):
    row = jax.tree.map(lambda ring: ring[0], memory.transitions)
    return replay.sample(row, memory.inserted, jax.random.key(0), size)


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
