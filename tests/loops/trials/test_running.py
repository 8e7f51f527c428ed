"""Trials on the point arm, from the first prompt to the ledger."""

import json
import os
import signal
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from trial_cases import ROBOT_TASK, arena, chance_chooser, chooser, plan, run, still, towards

from hcpg import registry
from hcpg.loops.trials.ledger import Ledger
from hcpg.loops.trials.operator import NobodyThereError, Opinion
from hcpg.loops.trials.plan import slots
from hcpg.loops.trials.running import run_trials
from hcpg.report.trial_records import LEDGER, STEPS
from hcpg.safety.faults import FaultyRobot


class Person:
    """Answers what it was told to, and keeps what it was shown."""

    judges = True

    def __init__(self, *opinions):
        self.opinions, self.shown = list(opinions), []

    def ready(self, trial, start, stopped):
        self.shown.append(f"{trial} at {start}")
        return not stopped()

    def opinion(self, trial):
        self.shown.append(f"{trial}?")
        return self.opinions.pop(0)


def test_the_one_that_reaches_succeeds_and_the_one_that_stands_still_does_not(tmp_path):
    progress, attempts = run(tmp_path, arena())
    assert (progress.ended, progress.signal) == ("", None)
    assert [(each.number, each.policy, each.start) for each in attempts] == [
        (slot.number, slot.policy, slot.start) for slot in slots(plan())
    ]
    good = [each for each in attempts if each.policy == "a"]
    poor = [each for each in attempts if each.policy == "b"]
    assert [(each.ended, each.detector, each.invalid) for each in good] == [("success", True, "")] * 2
    assert [(each.ended, each.detector, each.steps) for each in poor] == [("time_limit", False, -1)] * 2
    # Its first-hit count is the number of actions that were carried out.
    assert all(each.steps == each.facts["actions"] > 3 for each in good)
    assert [each.facts["actions"] for each in poor] == [60, 60]
    assert attempts[0].facts["timing"]["skipped"] == 0
    assert poor[0].facts["effective_candidates"] == pytest.approx(4.0)


def test_the_first_hit_is_the_action_before_the_detector_says_so(tmp_path):
    _, attempts = run(tmp_path, arena(), trials=1)
    hit = next(each for each in attempts if each.detector)
    folder = next(tmp_path.glob(f"trial_{hit.number:03d}_{hit.code}"))
    rows = [json.loads(line) for line in (folder / STEPS).read_text().splitlines()]
    steps = [row for row in rows if row["kind"] == "step"]
    assert [row["success"] for row in steps].index(True) == len(steps) - 1
    assert sum(row["executed"] is not None for row in steps) == hit.steps


def test_stopping_after_each_trial_changes_nothing(tmp_path):
    chance = {"a": chance_chooser, "b": partial(chooser, towards)}
    _, whole = run(tmp_path / "whole", arena(**chance))
    parts = tmp_path / "parts"
    for _ in range(4):
        with _Once(parts, plan()) as ledger:
            run_trials(arena(**chance), ledger, [].append)
    _, attempts = run(parts, arena(**chance))
    kept = [each._replace(facts={}) for each in whole]
    assert [each._replace(facts={}) for each in attempts] == kept
    assert [each.facts["actions"] for each in attempts] == [each.facts["actions"] for each in whole]
    assert [each.facts["spread"] for each in attempts] == [each.facts["spread"] for each in whole]


class _Once(Ledger):
    """A ledger that says all is done after one trial."""

    given = False

    def next(self):
        turn = None if self.given else super().next()
        self.given = True
        return turn


def test_the_operator_sees_codes_alone_and_disagrees(tmp_path):
    person, told = Person(Opinion(True, ""), Opinion(True, ""), Opinion(False, ""), Opinion(True, "")), []
    _, attempts = run(tmp_path, arena(operator=person, referee=lambda: True), told=told)
    assert [each.operator for each in attempts] == [True, True, False, True]
    assert [each.referee for each in attempts] == [True] * 4
    first = slots(plan())[0]
    assert person.shown[:2] == [
        f"Trial 1 of 4 ({first.code}) at {first.start}",
        f"Trial 1 of 4 ({first.code})?",
    ]
    names = [each.disagreement for each in attempts]
    assert [bool(each) for each in names] == [not (each.detector and each.operator) for each in attempts]
    # No line that is shown tells one policy from the other.
    assert all(line.split(" at ")[0].rstrip("?") in told for line in person.shown)


def test_an_opinion_may_make_a_trial_invalid_and_it_is_tried_again(tmp_path):
    person = Person(Opinion(None, "the operator: caught"), *[Opinion(False, "")] * 4)
    _, attempts = run(tmp_path, arena(operator=person))
    assert [(each.number, each.attempt) for each in attempts] == [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1)]
    assert attempts[0].invalid == "the operator: caught"
    assert "again" in person.shown[2]
    assert len({path.name for path in tmp_path.glob("trial_001_*")}) == 2


def test_ctrl_c_makes_the_running_trial_invalid_and_the_next_call_repeats_it(tmp_path):
    calls = []

    def interrupted(observation, count, draw):
        calls.append(draw)
        if len(calls) == 5:
            os.kill(os.getpid(), signal.SIGINT)
        return still(observation, count, draw)

    stopped = {name: partial(chooser, interrupted) for name in "ab"}
    progress, attempts = run(tmp_path, arena(**stopped))
    assert (progress.ended, progress.signal) == ("signal SIGINT", signal.SIGINT)
    assert [each.invalid for each in attempts] == ["stopped: signal SIGINT"]
    _, attempts = run(tmp_path, arena())
    assert [(each.number, each.attempt) for each in attempts] == [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1)]


def test_a_reflex_is_a_failure_that_counts(tmp_path):
    rig = registry.robot("point").make("point/reach", None)
    faulty = FaultyRobot(rig.robot)

    def reflex(observation, count, draw):
        if draw == 3:
            faulty.strike("reflex")
        return still(observation, count, draw)

    made = arena(rig._replace(robot=faulty), **{name: partial(chooser, reflex) for name in "ab"})
    _, attempts = run(tmp_path, made, trials=1)
    assert [(each.ended, each.detector, each.invalid) for each in attempts] == [("fault", False, "")] * 2


def test_a_lost_camera_makes_it_invalid_twice_and_then_it_is_left(tmp_path):
    class Blind:
        age_limit_s = 0.4

        def look(self, snapshot, now_s):
            return {}

        def forget(self):
            pass

    rig = registry.robot("point").make("point/reach", None)
    _, attempts = run(tmp_path, arena(rig._replace(perception=Blind())), trials=1)
    assert [(each.number, each.attempt) for each in attempts] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert {each.invalid for each in attempts} == {
        "the camera was lost: 100 % of the ticks had no fresh sighting"
    }


def test_when_nobody_answers_any_more_the_arm_is_let_go_and_the_ledger_says_so(tmp_path):
    class Gone(Person):
        def ready(self, trial, start, stopped):
            raise NobodyThereError("the input ended")

    rig = registry.robot("point").make("point/reach", None)
    with pytest.raises(NobodyThereError):
        run(tmp_path, arena(rig, operator=Gone()))
    assert rig.robot.observe().mode == "disconnected"
    [row] = [json.loads(line) for line in (tmp_path / LEDGER).read_text().splitlines()]
    assert (row["row"], row["what"]) == ("event", "fault: the input ended")


def test_the_referee_is_asked_at_every_tick_and_once_more_at_the_end(tmp_path):
    asked = []
    _, attempts = run(tmp_path, arena(referee=lambda: bool(asked.append(1))), trials=1)
    ticks = sum(each.facts["timing"]["ticks"] for each in attempts)
    held = sum(each.facts["held"] for each in attempts)
    assert ticks - held <= len(asked) <= ticks + len(attempts)
    assert [each.referee for each in attempts] == [False, False]


def test_a_policy_that_raises_leaves_the_trial_to_be_repeated(tmp_path):
    def broken(observation, count, draw):
        raise ZeroDivisionError("in the policy")

    with pytest.raises(ZeroDivisionError):
        run(tmp_path, arena(**{name: partial(chooser, broken) for name in "ab"}))
    _, attempts = run(tmp_path, arena())
    assert [(each.number, each.attempt) for each in attempts][:2] == [(1, 1), (1, 2)]


def test_the_detector_is_made_anew_for_every_trial(tmp_path):
    made = []

    def detector():
        made.append(ROBOT_TASK.make_detector())
        return made[-1]

    run(tmp_path, arena(task=replace(ROBOT_TASK, make_detector=detector)))
    assert len(made) == 4
    assert np.unique([id(each) for each in made]).size == 4
