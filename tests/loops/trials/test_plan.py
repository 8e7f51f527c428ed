"""The frozen plan: who goes when, from where, and what its hash covers."""

from collections import Counter
from dataclasses import replace

import pytest
from trial_cases import plan

from hcpg.loops.trials.plan import PlanError, slots, starts
from hcpg.report.trial_records import digest_of


def test_every_policy_starts_from_the_same_states_once():
    drawn = slots(plan(trials=15, policies=3))
    assert len(drawn) == 45
    assert [slot.number for slot in drawn] == list(range(1, 46))
    by_policy = {name: [slot.start for slot in drawn if slot.policy == name] for name in "abc"}
    assert by_policy["a"] == by_policy["b"] == by_policy["c"] == list(starts(plan(trials=15)))
    assert len(set(by_policy["a"])) == 15


@pytest.mark.parametrize("policies", [2, 3])
def test_the_order_is_turned_round_at_every_second_start(policies):
    names = [slot.policy for slot in slots(plan(trials=8, policies=policies))]
    turns = [tuple(names[first : first + policies]) for first in range(0, len(names), policies)]
    assert [turn[::-1] for turn in turns[0::2]] == turns[1::2]
    # Drawn anew for each pair: who comes first is not always the same one.
    assert len({turn[0] for turn in turns[0::2]}) == policies
    # ABBA: every policy has the same mean place, (n + 1) / 2.
    places = {name: [i for i, each in enumerate(names, 1) if each == name] for name in set(names)}
    assert {sum(each) / 8 for each in places.values()} == {(8 * policies + 1) / 2}


def test_a_code_is_shown_once_and_says_nothing():
    drawn = slots(plan(trials=100, policies=3))
    assert max(Counter(slot.code for slot in drawn).values()) == 1
    assert all(len(slot.code) == 4 and not set(slot.code) & set("AEIOUY") for slot in drawn)


def test_one_task_s_order_and_codes_tell_nothing_of_another_s():
    here, there = slots(plan(trials=15)), slots(replace(plan(trials=15), task="point/carry"))
    assert [slot.start for slot in here if slot.policy == "a"] == [s.start for s in there if s.policy == "a"]
    assert [slot.policy for slot in here] != [slot.policy for slot in there]
    assert not {slot.code for slot in here} & {slot.code for slot in there}


def test_the_hash_covers_everything():
    first = plan()
    others = [
        replace(first, seed=1),
        replace(first, trials=3),
        replace(first, horizon=61),
        replace(first, robot="another"),
        replace(first, kind="real"),
        replace(first, served=True),
        replace(first, limits=replace(first.limits, step_m=0.019)),
        replace(first, policies={**first.policies, "a": {"sha256": "other"}}),
        replace(first, policies=dict(reversed(first.policies.items()))),
    ]
    digests = [digest_of(each.as_json()) for each in (first, plan(), *others)]
    assert digests[0] == digests[1]
    assert len(set(digests)) == 10


@pytest.mark.parametrize(("changed", "told"), [({"policies": {}}, "no policy"), ({"trials": 0}, "0 trials")])
def test_what_measures_nothing_is_refused(changed, told):
    with pytest.raises(PlanError, match=told):
        replace(plan(), **changed)
