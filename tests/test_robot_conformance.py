"""What every robot that runs in this process must do; a new file is tested the day it appears."""

from functools import cache

import numpy as np
import pytest

from hcpg import registry
from hcpg.interfaces import Clock, Perception, Robot, Stage
from hcpg.robot_types import Command, RobotError
from hcpg.safety.limiting import outside_m

PERIOD_S = 1 / 30


@cache
def first_task(name):
    """The first task that the robot can do here, without an address; None if there is none."""
    for task in registry.robot_task_names():
        try:
            registry.robot(name).make(task, None)
        except RobotError:
            continue
        return task
    return None


@pytest.fixture
def rig(request):
    task = first_task(request.param)
    if task is None:
        pytest.skip("it needs an address")
    rig = registry.robot(request.param).make(task, None)
    rig.stage.arrange(0)
    rig.robot.connect(5.0)
    rig.robot.reset(registry.robot_task(task).home, registry.robot_task(task).home_grip, 15.0)
    yield rig
    rig.robot.close()
    rig.robot.close()


def pass_time(robot, seconds):
    robot.clock.sleep_until(robot.clock.now_s() + seconds)


def command(robot, sequence, delta, epoch=None):
    state = robot.observe()
    wanted = Command(sequence, state.epoch if epoch is None else epoch, state.position + delta, "keep")
    return robot.command(wanted)


UP = np.array([0.0, 0.0, 0.009])


@pytest.mark.parametrize("rig", registry.names("robots"), indirect=True)
class TestRobot:
    def test_the_rig_has_its_sockets(self, rig):
        assert isinstance(rig.robot, Robot)
        assert isinstance(rig.robot.clock, Clock)
        assert isinstance(rig.perception, Perception)
        assert isinstance(rig.stage, Stage)

    def test_a_state_is_finite_recent_and_inside_the_box(self, rig):
        state = rig.robot.observe()
        assert np.isfinite([*state.position, *state.velocity, *state.quaternion, *state.joint_angles]).all()
        assert np.linalg.norm(state.quaternion) == pytest.approx(1.0, abs=1e-6)
        assert 0.0 <= rig.robot.clock.now_s() - state.host_time_s < 0.05
        assert outside_m(state.position, rig.robot.limits) == 0.0
        assert state.mode in ("idle", "move")

    def test_states_go_on_with_the_time(self, rig):
        first = rig.robot.observe()
        pass_time(rig.robot, 0.1)
        second = rig.robot.observe()
        assert second.sequence > first.sequence
        assert second.robot_time_s - first.robot_time_s == pytest.approx(0.1, abs=0.02)

    def test_commands_move_it_their_way_and_a_hold_ends_that(self, rig):
        robot = rig.robot
        start = robot.observe().position
        for number in range(15):
            assert command(robot, number, UP).applied
            pass_time(robot, PERIOD_S)
        moved = robot.observe().position - start
        assert moved[2] > 0.02
        assert np.abs(moved[:2]).max() < 0.2 * moved[2]
        robot.hold()
        pass_time(robot, 0.3)
        held = robot.observe().position
        for _ in range(15):
            robot.hold()  # again and again: it must not creep
            pass_time(robot, PERIOD_S)
        assert robot.observe().position == pytest.approx(held, abs=0.001)

    def test_a_number_seen_before_is_refused(self, rig):
        assert command(rig.robot, 5, UP).applied
        assert command(rig.robot, 5, UP).refusal == "sequence"
        assert command(rig.robot, 4, UP).refusal == "sequence"

    @pytest.mark.parametrize("begin", ["recover", "reset"])
    def test_a_command_of_before_a_new_epoch_is_refused_and_moves_nothing(self, rig, begin):
        robot = rig.robot
        old = robot.observe().epoch
        if begin == "recover":
            assert robot.recover(5.0).recovered
        else:
            place = tuple(robot.observe().position.tolist())
            robot.reset(place, "keep", 15.0)
        pass_time(robot, 0.3)
        before = robot.observe()
        assert before.epoch > old
        assert command(robot, 100, UP, epoch=old).refusal == "epoch"
        pass_time(robot, 0.2)
        assert robot.observe().position == pytest.approx(before.position, abs=0.002)

    def test_wild_targets_are_refused(self, rig):
        high = np.array([0, 0, rig.robot.limits.lead_m + 0.005])
        assert command(rig.robot, 1, high).refusal == "lead"
        assert command(rig.robot, 2, np.array([np.nan, 0, 0])).refusal == "not_finite"
        assert command(rig.robot, 3, np.array([10.0, 0, 0])).refusal == "box"

    def test_a_stopped_robot_stays_stopped_until_it_is_connected(self, rig):
        robot = rig.robot
        assert command(robot, 1, UP).applied
        robot.stop("a test")
        robot.stop("a test, again")
        pass_time(robot, 0.3)
        before = robot.observe().position
        assert command(robot, 2, UP).refusal in ("stopped", "disconnected")
        robot.hold()
        assert not robot.recover(1.0).recovered
        home = tuple(before.tolist())
        with pytest.raises(RobotError, match=r"stop|connect"):
            robot.reset(home, "keep", 5.0)
        pass_time(robot, 0.2)
        assert robot.observe().position == pytest.approx(before, abs=0.002)
        robot.connect(5.0)
        assert command(robot, 0, UP).applied

    def test_what_the_task_needs_is_seen_within_a_second_and_forgotten_when_asked(self, rig, request):
        task = registry.robot_task(first_task(request.node.callspec.params["rig"]))
        rig.perception.forget()
        for _ in range(30):
            now_s, state = rig.robot.clock.now_s(), rig.robot.observe()
            sight = rig.perception.look(state, now_s)
            if set(sight) >= set(task.objects):
                break
            pass_time(rig.robot, PERIOD_S)
        observation = task.observe(state, sight)
        assert observation.shape == (task.observation_size,)
        assert np.isfinite(observation).all()
        assert all(sight[name].seen_s >= now_s - 1.0 for name in task.objects)
        assert task.make_detector().update(state, sight) is False
