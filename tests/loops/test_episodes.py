"""The bookkeeping of episodes, step by step by hand."""

import json

import numpy as np

from hcpg.loops.episodes import Episodes
from hcpg.loops.pool import Arrival


def arrival(rewards, success=(False, False), terminated=(False, False), truncated=(False, False)):
    observations = np.zeros((2, 3), np.float32)
    flags = (np.array(each) for each in (terminated, truncated, success))
    return Arrival(observations, observations, np.array(rewards, np.float32), *flags)


def test_an_episode_that_succeeds_in_its_second_step_and_loses_it_again():
    episodes = Episodes.begin(np.array([11, 22]))
    episodes, none = episodes.advance(arrival([1.0, 0.5]), np.array([33, 44]))
    episodes, still_none = episodes.advance(arrival([2.0, 0.5], success=(True, False)), np.array([33, 44]))
    assert none == still_none == []
    assert episodes.steps_to_success.tolist() == [2, -1]
    episodes, records = episodes.advance(arrival([4.0, 0.5], truncated=(True, False)), np.array([33, 44]))
    assert records == [
        {
            "environment": 0,
            "start": 11,
            "success_once": True,
            "success_at_end": False,
            "steps_to_success": 2,
            "return": 7.0,
            "length": 3,
        }
    ]
    assert episodes.start.tolist() == [33, 22]
    assert episodes.number.tolist() == [1, 0]
    assert episodes.length.tolist() == [0, 3]
    assert episodes.reward_sum.tolist() == [0.0, 1.5]
    assert episodes.steps_to_success.tolist() == [-1, -1]


def test_success_in_the_very_step_that_ends_it_counts_once_and_at_the_end():
    episodes = Episodes.begin(np.array([1, 2]))
    _, records = episodes.advance(
        arrival([0.0, 3.0], success=(False, True), terminated=(True, True)), np.array([3, 4])
    )
    kept = [[r["success_once"], r["success_at_end"], r["steps_to_success"], r["length"]] for r in records]
    assert kept == [[False, False, -1, 1], [True, True, 1, 1]]


def test_a_later_success_does_not_move_the_first():
    episodes = Episodes.begin(np.array([1, 2]))
    for success in (True, False, True):
        episodes, _ = episodes.advance(arrival([0.0, 0.0], success=(success, False)), np.array([3, 4]))
    assert episodes.steps_to_success.tolist() == [1, -1]


def test_the_next_episodes_first_success_is_counted_anew():
    episodes = Episodes.begin(np.array([1, 2]))
    for ends in (True, False):
        step = arrival([1.0, 1.0], success=(True, False), truncated=(ends, False))
        episodes, _ = episodes.advance(step, np.array([3, 4]))
    assert episodes.steps_to_success.tolist() == [1, -1]
    assert episodes.length.tolist() == [1, 2]
    assert episodes.reward_sum.tolist() == [1.0, 2.0]


def test_json_keeps_every_field_exactly():
    episodes = Episodes.begin(np.array([2**31 - 1, 7]))
    episodes, _ = episodes.advance(arrival([0.1, 1 / 3], success=(True, False)), np.array([0, 0]))
    back = Episodes.from_json(json.loads(json.dumps(episodes.as_json())))
    for one, other in zip(episodes, back, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype
