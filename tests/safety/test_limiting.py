"""Each limit by hand: a box of 1 m around the origin, steps of 10 mm, 30 Hz."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hcpg.robot_types import Limits, Snapshot
from hcpg.safety.limiting import Motion, limit, outside_m, unfit

LIMITS = Limits(box_low_m=(-0.5, -0.5, -0.5), box_high_m=(0.5, 0.5, 0.5))
RUNNING = Motion(target=None, elapsed_s=1 / 30, running_s=10.0)


def at(position, force=None):
    return Snapshot(
        0, 1, 0.0, 0.0, np.asarray(position, float), np.zeros(3), np.zeros(4), np.zeros(7),
        None if force is None else np.asarray(force, float), 0.08, 0.0, 0, "move", 1.0,
    )  # fmt: skip


def limited(action, position=(0, 0, 0), motion=RUNNING, limits=LIMITS, force=None):
    return limit(np.asarray(action, float), at(position, force), limits, motion)


def test_a_small_action_is_untouched():
    answer = limited([0.3, -0.4, 0.5])
    assert answer.touched == ()
    assert answer.position == pytest.approx([0.003, -0.004, 0.005])
    assert answer.executed == pytest.approx([0.3, -0.4, 0.5])


def test_a_step_keeps_its_direction_and_is_10_mm_long():
    answer = limited([1.0, 1.0, 1.0])
    assert answer.touched == ("step",)
    assert answer.position == pytest.approx([0.01 / 3**0.5] * 3)
    assert answer.executed == pytest.approx([3**-0.5] * 3)


def test_numbers_beyond_one_are_one_per_axis_before_anything_else():
    answer = limited([1000.0, 0.0, -0.5])
    assert answer.touched == ("unit", "step")
    length = (1 + 0.25) ** 0.5
    assert answer.executed == pytest.approx([1 / length, 0, -0.5 / length])


def test_the_delta_counts_from_the_measured_position_not_from_the_last_target():
    motion = RUNNING._replace(target=np.array([0.005, 0, 0]))
    assert limited([0.5, 0, 0], motion=motion).position == pytest.approx([0.005, 0, 0])


def test_the_target_leaves_no_face_of_the_box():
    answer = limited([1, 0, 0], position=(0.496, 0, 0))
    assert answer.touched == ("box",)
    assert answer.position == pytest.approx([0.5, 0, 0])
    assert answer.executed == pytest.approx([0.4, 0, 0])  # 4 mm of the 10 asked for


def test_an_arm_outside_the_box_is_led_back_one_step_at_a_time():
    answer = limited([1, 0, 0], position=(0.53, 0, 0))
    assert answer.touched == ("box", "lead")
    assert answer.position == pytest.approx([0.52, 0, 0])


def test_steps_grow_within_the_ramp():
    # 0.2 s are 6 periods: the first step may be 10 mm / 6, the third half of it, the sixth all.
    lengths = [limited([1, 0, 0], motion=RUNNING._replace(running_s=n / 30)).executed[0] for n in range(7)]
    assert lengths == pytest.approx([1 / 6, 2 / 6, 3 / 6, 4 / 6, 5 / 6, 1, 1])


def test_the_target_itself_moves_at_most_at_the_speed_cap():
    # Last target 10 mm ahead, asked for 10 mm back: 20 mm in 1/30 s; the cap of 0.45 m/s allows 15.
    answer = limited([-1, 0, 0], motion=RUNNING._replace(target=np.array([0.01, 0, 0])))
    assert answer.touched == ("speed",)
    assert answer.position == pytest.approx([-0.005, 0, 0])


def test_the_lead_is_what_the_force_allows():
    # 5 N at 2000 N/m are 2.5 mm.
    soft = Limits(LIMITS.box_low_m, LIMITS.box_high_m, force_n=5.0)
    answer = limited([0, 0, 1], limits=soft)
    assert answer.touched == ("lead",)
    assert answer.position == pytest.approx([0, 0, 0.0025])


def test_a_pressed_contact_is_not_pressed_harder_but_can_be_left():
    # 40 N from below, bound 30 N: down goes, sideways stays, up stays.
    push = [0, 0, 40.0]
    down = limited([0.3, 0, -0.5], force=push)
    assert (down.touched, list(down.executed)) == (("force",), pytest.approx([0.3, 0, 0]))
    assert limited([0.3, 0, 0.5], force=push).touched == ()
    assert limited([0.3, 0, -0.5], force=[0, 0, 29.0]).touched == ()


@pytest.mark.parametrize(("lever", "grip"), [(0.5, "open"), (-0.5, "close"), (0.49, "keep"), (-7.0, "close")])
def test_the_fourth_entry_moves_the_gripper(lever, grip):
    answer = limited([0, 0, 0, lever])
    assert answer.grip == grip
    assert answer.executed == pytest.approx([0, 0, 0, max(lever, -1)])


def test_three_numbers_leave_the_gripper_alone():
    assert limited([0, 0, 0]).grip == "keep"


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        ([np.nan, 0, 0], "not finite"),
        ([np.inf, 0, 0], "not finite"),
        ([0, 0], "shape (2,), not (3,)"),
        ([[0, 0, 0]], "shape (1, 3), not (3,)"),
        (["a", "b", "c"], "not of numbers"),
    ],
)
def test_what_is_no_action_is_named(action, reason):
    assert reason in unfit(np.asarray(action), 3)
    assert unfit(np.zeros(3), 3) == ""


def test_what_is_no_action_is_refused():
    with pytest.raises(ValueError, match="hold instead"):
        limited([np.nan, 0, 0])


def test_outside_is_the_distance_to_the_box():
    assert outside_m(np.array([0.53, -0.54, 0.1]), LIMITS) == pytest.approx(0.05)
    assert outside_m(np.array([0.5, -0.5, 0.1]), LIMITS) == 0.0


coordinate = st.floats(-0.5, 0.5)
component = st.floats(-1e6, 1e6)


@given(
    st.tuples(*[component] * 4), st.tuples(*[coordinate] * 3), st.tuples(*[coordinate] * 3), st.floats(0, 1)
)
def test_whatever_is_asked_for_stays_in_the_box_and_within_a_step(action, position, last, running_s):
    answer = limited(action, position, Motion(np.asarray(last), 1 / 30, running_s))
    assert outside_m(answer.position, LIMITS) < 1e-12
    assert np.linalg.norm(answer.position - position) <= 0.01 + 1e-12
    assert np.abs(answer.executed).max() <= 1 + 1e-9
    assert answer.position == pytest.approx(np.asarray(position) + 0.01 * answer.executed[:3])
