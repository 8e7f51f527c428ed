"""The Franka tasks: what they observe, how their adapters read it, when their detectors say yes; by hand."""

import numpy as np
import pytest

from hcpg import registry
from hcpg.robot_types import Sighting, Snapshot

DOWN = np.array([1.0, 0.0, 0.0, 0.0])
NAMES = ("peg-insertion", "button-press", "drawer-closing", "rugby-grasp")


def snapshot(position, width_m=0.0, quaternion=DOWN, time_s=2.0):
    return Snapshot(
        1, 1, time_s, time_s, np.asarray(position, float), np.array([0.1, 0.0, -0.1]), quaternion,
        np.zeros(7), None, width_m, time_s, 0, "move", 1.0,
    )  # fmt: skip


def seen(position, time_s=np.inf):
    return Sighting(np.asarray(position, float), time_s)


def task(name):
    return registry.task(f"franka/{name}")


def scene(name, family, state, sight):
    return task(name).adapters[family](task(name).robot.observe(state, sight))


@pytest.mark.parametrize("name", NAMES)
def test_the_robots_part_of_a_task_agrees_with_its_suite(name):
    from hcpg.twin.scenes import SCENES

    robot = task(name).robot
    assert registry.suite("franka").spec(task(name)) == (19, robot.action_size)
    assert robot.action_size == (4 if name == "rugby-grasp" else 3)
    twin = SCENES[name]
    assert (robot.home, robot.home_grip) == (twin.home, twin.home_grip)
    assert set(robot.objects) == {twin.fixed, twin.moving} - {""}


def test_an_observation_has_each_number_in_its_place():
    sight = {"ball": seen([0.41, 0.02, 0.04], time_s=1.7)}
    observed = task("rugby-grasp").robot.observe(snapshot([0.4, 0.0, 0.05], width_m=0.06), sight)
    expected = [0.4, 0, 0.05, 1, 0, 0, 0, 0.1, 0, -0.1, 0.75, 1, 0.41, 0.02, 0.04, 0.41, 0.02, 0.132, 0.3]
    np.testing.assert_allclose(observed, expected, atol=1e-6)


def test_fingers_that_stand_elsewhere_hold_nothing():
    def held(position, width_m):
        sight = {"ball": seen([0.40, 0.0, 0.04], 2.0)}
        return task("rugby-grasp").robot.observe(snapshot(position, width_m), sight)[11]

    assert held([0.40, 0.0, 0.04], 0.06) == 1.0
    assert held([0.40, 0.0, 0.04], 0.08) == 0.0
    assert held([0.40, 0.0, 0.04], 0.01) == 0.0
    assert held([0.40, 0.0, 0.14], 0.06) == 0.0


def test_the_tip_of_the_peg_is_the_tool_also_of_a_tilted_hand():
    sight = {"hole": seen([0.45, 0.01, 0.06])}
    upright = scene("peg-insertion", "paper", snapshot([0.44, 0.0, 0.2]), sight)
    np.testing.assert_allclose(upright.tool, [0.44, 0.0, 0.14], atol=1e-6)
    np.testing.assert_allclose(upright.approach, [0.01, 0.01, -0.08], atol=1e-6)
    np.testing.assert_allclose(upright.task, [0.0, 0.0, -0.03], atol=1e-6)
    assert upright.contact is None
    # Down, then turned by 30 degrees about the base's y: the peg points to (-sin 30, 0, -cos 30).
    tilted = np.array([np.cos(np.pi / 12), 0.0, -np.sin(np.pi / 12), 0.0])
    leaning = scene("peg-insertion", "paper", snapshot([0.44, 0.0, 0.2], quaternion=tilted), sight)
    np.testing.assert_allclose(leaning.tool, [0.44 - 0.03, 0.0, 0.2 - 0.06 * np.cos(np.pi / 6)], atol=1e-6)


def test_the_paper_reading_of_the_others():
    press = scene("button-press", "paper", snapshot([0.4, 0.0, 0.1]), {"button": seen([0.42, 0.0, 0.056])})
    np.testing.assert_allclose(press.approach, [0.02, 0.0, -0.044], atol=1e-6)
    np.testing.assert_allclose(press.task, [0.0, 0.0, -0.012], atol=1e-6)
    sight = {"drawer": seen([0.45, 0.01, 0.055], 1.9), "cabinet": seen([0.588, 0.01, 0.055])}
    close = scene("drawer-closing", "paper", snapshot([0.40, 0.01, 0.055]), sight)
    np.testing.assert_allclose(close.approach, [0.05, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(close.task, [0.138, 0.0, 0.0], atol=1e-6)
    lift = scene(
        "rugby-grasp", "paper", snapshot([0.4, 0.0, 0.05], 0.06), {"ball": seen([0.41, 0.0, 0.052], 2)}
    )
    np.testing.assert_allclose(lift.task, [0.0, 0.0, 0.08], atol=1e-6)
    assert lift.contact == 1.0


def test_the_contact_reading_stays_above_until_it_is_aligned():
    hole = {"hole": seen([0.45, 0.0, 0.06])}
    aside = scene("peg-insertion", "contact", snapshot([0.44, 0.0, 0.13]), hole)
    np.testing.assert_allclose(aside.approach, [0.01, 0.0, 0.002], atol=1e-6)
    assert aside.contact == 0.0
    above = scene("peg-insertion", "contact", snapshot([0.448, 0.0, 0.13]), hole)
    np.testing.assert_allclose(above.task, [0.002, 0.0, -0.04], atol=1e-6)
    assert above.contact == 1.0
    sight = {"drawer": seen([0.45, 0.0, 0.055]), "cabinet": seen([0.588, 0.0, 0.055])}
    high = scene("drawer-closing", "contact", snapshot([0.40, 0.0, 0.105]), sight)
    np.testing.assert_allclose(high.approach, [0.01, 0.0, -0.05], atol=1e-6)
    assert high.contact == 0.0


def answers(name, states, sight):
    detector = task(name).robot.make_detector()
    return [detector.update(state, sight) for state in states]


def test_a_peg_counts_after_three_ticks_below_25_mm():
    hole = {"hole": seen([0.45, 0.0, 0.06])}
    deep, shallow, beside = (snapshot([x, 0.0, z]) for x, z in ((0.45, 0.094), (0.45, 0.096), (0.46, 0.094)))
    assert answers("peg-insertion", [deep, deep, deep], hole) == [False, False, True]
    assert answers("peg-insertion", [deep, shallow, deep, deep], hole) == [False] * 4
    assert answers("peg-insertion", [beside] * 4, hole) == [False] * 4


def test_a_button_counts_at_once_from_11_mm_of_travel_on():
    button = {"button": seen([0.45, 0.0, 0.056])}
    states = [snapshot([0.45, 0.0, 0.0535]), snapshot([0.45, 0.0, 0.0525]), snapshot([0.48, 0.0, 0.0525])]
    assert answers("button-press", states, button) == [False, True, False]


def test_a_drawer_counts_when_it_is_seen_shut():
    open_by = [
        {"drawer": seen([0.588 - gap, 0, 0.055]), "cabinet": seen([0.588, 0, 0.055])} for gap in (0.01, 0.007)
    ]
    detector = task("drawer-closing").robot.make_detector()
    states = [detector.update(snapshot([0.5, 0, 0.055]), sight) for sight in [open_by[0]] + 3 * [open_by[1]]]
    assert states == [False, False, False, True]


def test_a_ball_counts_after_a_second_of_holding_it_5_cm_higher():
    low, high, lost = (
        snapshot([0.45, 0, 0.035], 0.06),
        snapshot([0.45, 0, 0.09], 0.06),
        snapshot([0.45, 0, 0.09], 0.01),
    )
    assert answers("rugby-grasp", [low] + [high] * 30, {}) == [False] * 30 + [True]
    assert not any(answers("rugby-grasp", [low] + [high] * 29 + [lost] + [high] * 29, {}))
    assert not any(answers("rugby-grasp", [high] * 40, {}))
