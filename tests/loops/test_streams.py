"""One seed, many streams: draws depend on their own counters and on nothing else."""

import jax
import numpy as np

from hcpg.loops.streams import EVALUATION_SEED, Stream, key, start_states


def test_every_stream_of_every_seed_is_another():
    keys = [tuple(jax.random.key_data(key(seed, stream)).tolist()) for seed in range(5) for stream in Stream]
    assert len(set(keys)) == 5 * 9


def test_a_stream_is_the_same_every_time():
    one, other = (jax.random.key_data(key(3, Stream.ACTOR)) for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_the_numbers_of_the_streams_never_change():
    """A stream renumbered would change every run that was ever made."""
    assert [each.name for each in Stream] == [
        "NETWORKS", "WARMUP", "ACTOR", "SELECTOR", "REPLAY", "LEARNING", "STARTS", "EVALUATION",
        "CLONING",
    ]  # fmt: skip
    assert [int(each) for each in Stream] == list(range(9))
    assert EVALUATION_SEED == 1_000_003


def test_start_states_do_not_depend_on_how_many_environments_there_are():
    few, many = start_states(0, np.array([4, 9])), start_states(0, np.array([4, 9, 2, 0, 7]))
    assert few.tolist() == many[:2].tolist()


def test_start_states_do_not_depend_on_the_other_environments_episodes():
    assert start_states(0, np.array([4, 9]))[0] == start_states(0, np.array([4, 1]))[0]


def test_start_states_differ_over_seeds_environments_and_episodes():
    every = [start_states(seed, np.full(8, episode)) for seed in range(3) for episode in range(20)]
    assert len(set(np.concatenate(every).tolist())) == 3 * 20 * 8
    assert min(each.min() for each in every) >= 0
    assert max(each.max() for each in every) < 2**31


def test_the_start_state_is_numpys_draw_from_the_four_counters():
    expected = np.random.default_rng([5, 6, 1, 3]).integers(2**31)  # seed, stream, environment, episode
    assert start_states(5, np.array([0, 3]))[1] == expected
