import signal

import numpy as np
import pytest
from point_rig import Scripted, new_rig

from hcpg.loops.control.watching import watch
from hcpg.robot_types import Check, Info, RobotError
from hcpg.safety.faults import FaultyRobot


def test_a_good_robot_is_ready_and_let_go():
    arm = new_rig().robot
    seen = watch(arm, 1.0)
    # Ticks 0 to 29, and the one due at one second.
    assert (seen.timing.ticks, seen.timing.skipped, seen.moved_mm, seen.outside_mm) == (31, 0, 0.0, 0.0)
    assert (seen.sound, seen.modes, seen.success_rate_min) == (True, ("move",), 1.0)
    assert arm.observe().mode == "disconnected"


def test_a_check_that_failed_is_not_ready():
    def connect(robot, timeout_s):
        info = robot.connect(timeout_s)
        return Info(
            info.name, info.kind, info.versions, (Check("frames", False, "off by 107 mm", "set F_T_EE"),)
        )

    assert watch(Scripted(new_rig().robot, connect=connect), 0.2).sound is False


def test_a_reflex_while_holding_is_not_ready():
    robot = FaultyRobot(new_rig().robot)
    made = robot.connect

    def connect(timeout_s):
        info = made(timeout_s)
        robot.strike("reflex")
        return info

    robot.connect = connect
    seen = watch(robot, 0.2)
    assert (seen.sound, seen.modes) == (False, ("reflex",))


def test_states_that_do_not_come_show_in_their_age():
    robot = FaultyRobot(new_rig().robot)
    robot.observe()
    connect = robot.connect
    robot.connect = lambda timeout_s: (connect(timeout_s), setattr(robot.wrong, "frozen", True))[0]
    seen = watch(robot, 1.0)
    assert (seen.state_age_max_ms, seen.sound) == (pytest.approx(1000.0), False)


def test_commands_that_come_late_are_not_ready():
    def watched(rate):
        arm = new_rig().robot
        observe = arm.observe
        arm.observe = lambda: observe()._replace(success_rate=rate)
        return watch(arm, 0.2).sound

    assert (watched(0.95), watched(0.94)) == (True, False)


def test_a_robot_outside_its_box_is_not_ready():
    arm = new_rig().robot
    arm._position = arm._target = np.array([0.0, 0.0, 0.38])
    seen = watch(arm, 0.2)
    assert (seen.sound, seen.outside_mm) == (False, pytest.approx(30.0))
    assert seen.info.checks[0].passed is False


def test_a_robot_that_does_not_answer_is_let_go_too():
    robot = FaultyRobot(new_rig().robot)
    robot.wrong.connects_failing = 1
    with pytest.raises(RobotError, match="nobody answers"):
        watch(robot, 1.0)
    assert robot.observe().mode == "disconnected"


def test_a_signal_ends_it_with_the_arm_stopped():
    arm = new_rig().robot
    observe, looks = arm.observe, []

    def interrupted():
        looks.append(None)
        if len(looks) == 5:
            signal.raise_signal(signal.SIGTERM)
        return observe()

    arm.observe = interrupted
    seen = watch(arm, 1000.0)
    assert (seen.signal, seen.sound, seen.timing.ticks) == (signal.SIGTERM, False, 4)
