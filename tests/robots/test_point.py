import numpy as np
import pytest

from hcpg import registry
from hcpg.robot_types import Command, RobotError
from hcpg.robots.point import LAG_S, JumpingClock, PointArm

HOME = (0.0, 0.0, 0.2)


def ready():
    arm = PointArm()
    arm.connect(1.0)
    arm.reset(HOME, "open", 5.0)
    return arm


def command(arm, sequence, delta, grip="keep"):
    state = arm.observe()
    return arm.command(Command(sequence, state.epoch, state.position + np.array(delta), grip))


def test_it_follows_a_step_with_its_lag():
    arm = ready()
    command(arm, 0, (0.02, 0, 0))
    arm.clock.sleep_until(arm.clock.now_s() + LAG_S)
    state = arm.observe()
    assert state.position == pytest.approx([0.02 * (1 - np.exp(-1)), 0, 0.2])
    assert state.velocity == pytest.approx([0.02 * np.exp(-1) / LAG_S, 0, 0])


def test_its_fingers_close_at_their_speed():
    arm = ready()
    command(arm, 0, (0, 0, 0), "close")
    arm.clock.sleep_until(arm.clock.now_s() + 0.5)
    assert arm.observe().gripper_width_m == pytest.approx(0.03)  # 80 mm less 0.5 s of 100 mm/s
    command(arm, 1, (0, 0, 0), "open")
    arm.clock.sleep_until(arm.clock.now_s() + 0.1)
    assert arm.observe().gripper_width_m == pytest.approx(0.04)


def test_time_jumps_forward_only():
    clock = JumpingClock()
    clock.sleep_until(2.0)
    clock.sleep_until(1.0)
    assert clock.now_s() == 2.0


def test_without_connection_nothing_is_done():
    arm = PointArm()
    assert arm.observe().mode == "disconnected"
    assert command(arm, 0, (0.01, 0, 0)).refusal == "stopped"
    with pytest.raises(RobotError, match="connect again"):
        arm.reset(HOME, "open", 1.0)


def test_a_start_outside_the_box_is_refused():
    with pytest.raises(RobotError, match="outside the box"):
        ready().reset((0.0, 0.0, 0.5), "open", 1.0)


def test_a_layout_belongs_to_its_number():
    stage = registry.robot("point").make("point/reach", None).stage
    places = []
    for start in (0, 1, 0):
        stage.arrange(start)
        places.append(np.concatenate([stage.places["object"], stage.places["goal"]]))
    assert places[0].tolist() == places[2].tolist() != places[1].tolist()
    assert places[0][2] == 0.02
