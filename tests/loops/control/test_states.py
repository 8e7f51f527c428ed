import math

import numpy as np
import pytest

from hcpg.loops.control.states import FOLLOWERS, Evidence, Freshness, IllegalTransitionError, Machine, judge
from hcpg.robot_types import Limits
from hcpg.robots.point import PointArm

LIMITS = Limits(box_low_m=(-0.5, -0.5, -0.5), box_high_m=(0.5, 0.5, 0.5))
FINE = Evidence(
    stop="", mode="move", same_epoch=True, finite=True, state_age_s=0.01, outside_m=0.0, gripper_refused=0,
    sight_age_s=0.1, sight_limit_s=0.4,
)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "state", "ends", "cause"),
    [
        ({}, "run", False, ""),
        ({"mode": "idle"}, "run", False, ""),
        ({"stop": "Ctrl-C"}, "stop", True, "Ctrl-C"),
        ({"mode": "user_stopped"}, "stop", True, "the user stop is pressed"),
        ({"mode": "disconnected"}, "reconnect", True, "the connection is lost"),
        ({"mode": "reflex"}, "reflex", True, "the robot's reflex"),
        ({"same_epoch": False}, "reflex", True, "a new epoch began in the episode"),
        ({"state_age_s": 0.050}, "run", False, ""),
        ({"state_age_s": 0.051}, "hold", False, "no new state for 51 ms"),
        ({"state_age_s": 0.500}, "hold", False, "no new state for 500 ms"),
        ({"state_age_s": 0.501}, "reconnect", True, "no new state for 501 ms"),
        ({"outside_m": 0.020}, "run", False, ""),
        ({"outside_m": 0.021}, "hold", True, "the arm is 21 mm outside its box"),
        ({"gripper_refused": 3}, "run", False, ""),
        ({"gripper_refused": 4}, "hold", True, "the gripper refused 4 commands"),
        ({"finite": False, "outside_m": math.nan}, "hold", False, "the measured position is not finite"),
        ({"mode": "guiding"}, "hold", False, "the robot is in mode guiding"),
        ({"mode": "recovering"}, "hold", False, "the robot is in mode recovering"),
    ],
)
def test_what_is_wrong_decides(change, state, ends, cause):
    verdict = judge(FINE._replace(**change), LIMITS)
    assert (verdict.state, verdict.ends, verdict.cause, verdict.alone) == (state, ends, cause, False)


@pytest.mark.parametrize(
    ("age_s", "state", "alone"),
    [
        (0.4, "run", False),
        (0.41, "hold", False),
        (0.9, "hold", False),
        (0.91, "run", True),
        (9.0, "run", True),
    ],
)
def test_an_old_sighting_means_hold_then_one_proposal(age_s, state, alone):
    # Perception allows 0.4 s; the limits hold for 0.5 s more.
    verdict = judge(FINE._replace(sight_age_s=age_s), LIMITS)
    assert (verdict.state, verdict.alone, verdict.ends) == (state, alone, False)


def test_an_object_never_seen_means_hold_however_long():
    verdict = judge(FINE._replace(sight_age_s=math.inf), LIMITS)
    assert (verdict.state, verdict.cause) == ("hold", "an object was never seen")


def test_the_gravest_decides():
    everything = FINE._replace(stop="fire", mode="reflex", state_age_s=9.0, finite=False)
    assert judge(everything, LIMITS).state == "stop"
    assert judge(everything._replace(stop=""), LIMITS).state == "reflex"


def test_run_is_entered_from_hold_alone_and_stop_is_never_left():
    assert [state for state, after in FOLLOWERS.items() if "run" in after] == ["hold", "run"]
    assert FOLLOWERS["stop"] == ("stop",)
    machine = Machine()
    assert [machine.move(state) for state in ("run", "run", "reflex", "recover", "hold", "run", "stop")] == [
        True, False, True, True, True, True, True,
    ]  # fmt: skip
    with pytest.raises(IllegalTransitionError, match="hold must not follow stop; allowed: stop"):
        machine.move("hold")


def test_no_way_leads_from_a_reflex_to_run_without_recovery():
    machine = Machine()
    machine.move("reflex")
    for state in ("run", "hold"):
        with pytest.raises(IllegalTransitionError, match="allowed: reflex, recover, reconnect, stop"):
            machine.move(state)


def test_age_counts_from_the_newest_controller_time():
    state, freshness = PointArm().observe(), Freshness()
    assert freshness.age_s(state._replace(robot_time_s=5.0, host_time_s=1.0), 1.01) == pytest.approx(0.01)
    # It arrives again and again: as old as when it first came.
    again = state._replace(robot_time_s=5.0, host_time_s=1.2, sequence=99)
    assert freshness.age_s(again, 1.2) == pytest.approx(0.2)
    assert freshness.age_s(state._replace(robot_time_s=4.9, host_time_s=1.3), 1.3) == pytest.approx(0.3)
    assert freshness.age_s(state._replace(robot_time_s=5.1, host_time_s=1.4), 1.4) == pytest.approx(0.0)
    assert np.isfinite(state.position).all()
