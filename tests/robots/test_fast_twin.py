"""The fast twin in the robot's socket: its clock, its refusals, its way home, its eyes."""

import itertools

import numpy as np
import pytest

from hcpg import registry
from hcpg.interfaces import Clock, Perception, Robot, Stage
from hcpg.robot_types import Command, RobotError

pytest.importorskip("mujoco")
TICK_S = 1.0 / 30.0
HOME = (0.45, 0.0, 0.20)
UP = np.array([0.0, 0.0, 0.008])


@pytest.fixture
def rig():
    made = registry.robot("twin").make("franka/button-press", None)
    made.robot.connect(1.0)
    return made


def wait(robot, ticks):
    robot.clock.sleep_until(robot.clock.now_s() + ticks * TICK_S)


def test_it_fits_its_sockets_and_is_called_a_twin(rig):
    assert isinstance(rig.robot, Robot)
    assert isinstance(rig.robot.clock, Clock)
    assert isinstance(rig.perception, Perception)
    assert isinstance(rig.stage, Stage)
    assert (registry.robot("twin").kind, rig.robot.connect(1.0).kind) == ("twin", "twin")


def test_time_passes_only_while_somebody_waits(rig):
    now_s, first = rig.robot.clock.now_s(), rig.robot.observe()
    assert rig.robot.clock.now_s() == now_s
    wait(rig.robot, 3)
    assert rig.robot.clock.now_s() - now_s == pytest.approx(0.1)
    assert rig.robot.observe().sequence - first.sequence == 48


def test_it_goes_where_it_is_told_and_holds(rig):
    for number in range(15):
        now = rig.robot.observe()
        ack = rig.robot.command(Command(number, now.epoch, now.position + UP, "keep"))
        assert ack.applied
        wait(rig.robot, 1)
    risen = rig.robot.observe()
    assert risen.velocity[2] > 0.03
    rig.robot.hold()
    wait(rig.robot, 15)
    rested = rig.robot.observe().position
    rig.robot.hold()
    wait(rig.robot, 15)
    assert np.linalg.norm(rig.robot.observe().position - rested) < 5e-4
    assert np.linalg.norm(rested - risen.position) < 0.02


def test_old_wild_and_far_commands_are_refused(rig):
    now, numbers = rig.robot.observe(), itertools.count(1)

    def answer(position, epoch=now.epoch):
        return rig.robot.command(Command(next(numbers), epoch, np.asarray(position, float), "keep")).refusal

    assert answer(now.position) == ""
    assert rig.robot.command(Command(1, now.epoch, now.position, "keep")).refusal == "sequence"
    assert answer(now.position, now.epoch - 1) == "epoch"
    assert answer(now.position + np.array([0.05, 0.0, 0.0])) == "lead"
    assert answer([0.45, 0.0, 0.0]) == "box"
    rig.robot.stop("test")
    rig.robot.stop("twice")
    assert answer(now.position) == "stopped"
    with pytest.raises(RobotError, match="connect first"):
        rig.robot.reset(HOME, "close", 5.0)


def test_it_goes_home_and_begins_a_new_epoch(rig):
    before = rig.robot.observe()
    rig.robot.reset((0.40, 0.08, 0.15), "open", 15.0)
    now = rig.robot.observe()
    assert np.linalg.norm(now.position - [0.40, 0.08, 0.15]) < 0.006
    assert now.epoch > before.epoch
    assert now.gripper_width_m > 0.075
    with pytest.raises(RobotError, match="not at its start after"):
        rig.robot.reset(HOME, "close", 0.1)


def test_a_scene_is_laid_out_once_the_arm_is_clear_of_it(rig):
    rig.robot.reset((0.45, 0.0, 0.12), "close", 15.0)
    low = rig.stage.truth().object
    rig.stage.arrange(5)
    np.testing.assert_array_equal(rig.stage.truth().object, low)
    rig.robot.reset(HOME, "close", 15.0)
    laid_out = rig.stage.truth().object
    assert np.linalg.norm(laid_out - low) > 0.005
    rig.stage.arrange(5)
    np.testing.assert_allclose(rig.stage.truth().object, laid_out, atol=1e-3)


def test_a_drawer_is_photographed_late_and_its_cabinet_was_touched_off():
    rig = registry.robot("twin").make("franka/drawer-closing", None)
    rig.robot.connect(1.0)
    for _ in range(15):
        sight = rig.perception.look(rig.robot.observe(), rig.robot.clock.now_s())
        wait(rig.robot, 1)
    truth = rig.stage.truth()
    assert sight["cabinet"].seen_s == np.inf
    np.testing.assert_allclose(sight["cabinet"].position, truth.goal, atol=0.0015)
    np.testing.assert_allclose(sight["drawer"].position, truth.object, atol=0.005)
    assert 0.1 <= rig.robot.clock.now_s() - TICK_S - sight["drawer"].seen_s < 0.4
    rig.perception.forget()
    assert "drawer" not in rig.perception.look(rig.robot.observe(), rig.robot.clock.now_s())


def test_what_the_twin_cannot_do_is_refused_with_the_cure():
    with pytest.raises(RobotError, match="it can do franka/peg-insertion"):
        registry.robot("twin").make("point/carry", None)
    with pytest.raises(RobotError, match="no loopback address"):
        registry.robot("twin").make("franka/button-press", "172.16.0.2")
