"""What each fault does to a robot; what the loop makes of them is in the drill's tests."""

import numpy as np
import pytest

from hcpg.robot_types import Command, RobotError
from hcpg.robots.point import PointArm
from hcpg.safety.faults import FaultyRobot


@pytest.fixture
def robot():
    made = FaultyRobot(PointArm())
    made.connect(1.0)
    made.reset((0.0, 0.0, 0.2), "open", 5.0)
    made.observe()
    return made


def pass_time(robot, seconds):
    robot.clock.sleep_until(robot.clock.now_s() + seconds)


def command(robot, sequence, grip="keep"):
    state = robot.observe()
    return robot.command(Command(sequence, state.epoch, state.position + np.array([0.01, 0, 0]), grip))


def test_without_fault_everything_passes_through(robot):
    assert command(robot, 0).applied
    pass_time(robot, 1.0)
    assert robot.observe().position == pytest.approx([0.01, 0, 0.2])
    assert (robot.seen.applied, robot.seen.refused) == (1, {})


def test_a_frozen_state_is_the_last_one(robot):
    before = robot.observe()
    robot.wrong.frozen = True
    pass_time(robot, 0.2)
    assert robot.observe() is before
    robot.connect(1.0)
    assert robot.observe().robot_time_s > before.robot_time_s


def test_a_repeated_state_arrives_anew_with_an_older_number(robot):
    before = robot.observe()
    robot.wrong.repeated = True
    pass_time(robot, 0.2)
    again = robot.observe()
    assert again.robot_time_s == before.robot_time_s
    assert again.host_time_s == pytest.approx(before.host_time_s + 0.2)
    assert again.sequence < before.sequence


def test_a_reflex_lasts_until_it_is_recovered(robot):
    epoch = robot.observe().epoch
    robot.strike("reflex")
    assert (robot.observe().mode, robot.observe().epoch) == ("reflex", epoch + 1)
    assert command(robot, 1).refusal == "reflex"
    with pytest.raises(RobotError, match="mode reflex"):
        robot.reset((0.0, 0.0, 0.2), "open", 5.0)
    robot.wrong.recoveries_failing, robot.wrong.recover_s = 1, 2.0
    before_s = robot.clock.now_s()
    assert not robot.recover(5.0).recovered
    assert robot.recover(5.0).recovered
    assert robot.clock.now_s() - before_s == pytest.approx(4.0)
    assert (robot.observe().mode, robot.observe().epoch) == ("move", epoch + 2)
    assert robot.seen.refused == {"reflex": 1}


def test_a_lost_connection_cannot_be_recovered(robot):
    robot.strike("disconnected")
    assert robot.recover(1.0).reconnect
    robot.wrong.connects_failing = 1
    with pytest.raises(RobotError, match="nobody answers"):
        robot.connect(1.0)
    robot.connect(1.0)
    assert command(robot, 0).applied


def test_a_delayed_command_arrives_later_and_not_after_a_new_epoch(robot):
    robot.wrong.command_delay_s = 0.1
    command(robot, 0)
    pass_time(robot, 0.05)
    assert robot.observe().position[0] == 0.0
    pass_time(robot, 0.06)
    robot.observe()
    assert robot.seen.applied == 1
    command(robot, 1)
    robot.strike("reflex")
    robot.recover(1.0)
    pass_time(robot, 0.2)
    robot.observe()
    assert (robot.seen.applied, robot.seen.refused) == (1, {"epoch": 1})


def test_lost_commands_are_acknowledged_and_move_nothing(robot):
    robot.wrong.command_loss = 0.3
    for number in range(100):
        command(robot, number)
        robot.hold()
    assert robot.seen.applied == pytest.approx(70, abs=18)  # 4 standard deviations


def test_a_gripper_that_refuses_counts_and_lets_the_arm_move(robot):
    robot.wrong.grip_refused = True
    assert command(robot, 0, "close").applied
    pass_time(robot, 0.5)
    state = robot.observe()
    assert (state.gripper_refusals, state.gripper_width_m) == (1, 0.08)
    assert state.position[0] > 0.009


def test_where_the_arm_really_was_is_counted_whatever_is_told(robot):
    robot.wrong.not_finite = True
    assert np.isnan(robot.observe().position).all()
    assert robot.seen.position.tolist() == [0.0, 0.0, 0.2]
    assert robot.seen.furthest_outside_m == 0.0
