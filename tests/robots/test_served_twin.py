"""The driver against the served twin: the real client library, the real protocol, reflexes enforced.

Needs the twin's own environment: run `make twin` first.
"""

import importlib.util
import itertools
import os
import signal
import subprocess
import time

import numpy as np
import pytest

from hcpg import registry
from hcpg.interfaces import Perception, Robot, Stage
from hcpg.robot_types import Command, RobotError
from hcpg.robots.franka.kinematics import flange_pose
from hcpg.robots.franka.setup import hand_frame
from hcpg.safety.priority import raise_priority
from hcpg.twin.launching import end, is_installed, served
from hcpg.twin.world import World

pytestmark = pytest.mark.skipif(
    not is_installed() or importlib.util.find_spec("franky") is None,
    reason="the served twin's environment or the arm's driver is missing: run `make twin`",
)
TASK, START_SEED = "button-press", 1_000_000
ADDRESSES = (
    f"127.{os.getpid() % 250 + 1}.{os.getpid() // 250 % 250 + 1}.{last}" for last in itertools.count(2)
)
TICK_S = 1.0 / 30.0


@pytest.fixture(scope="module", autouse=True)
def before_ordinary_programs():
    """As the control process does, where it may: on a busy machine nothing here would be in time."""
    raise_priority()
    yield
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    log = tmp_path_factory.mktemp("served") / "twin.log"
    with served(TASK, next(ADDRESSES), START_SEED, log) as running:
        yield running


@pytest.fixture
def rig(twin):
    rig = registry.robot("twin").make(f"franka/{TASK}", twin.address)
    rig.robot.connect(10.0)
    yield rig
    rig.robot.close()
    rig.stage.close()


def drive(robot, deltas, number, times_s=None):
    """Send one target per tick, a delta from the measured position; gives positions and times of the ticks.

    Times are the controller's own. A busy machine makes ticks late: given `times_s`, those of another drive,
    this one sends at the same moments.
    """
    seen, sent_s, begun_s = [], [], robot.observe().robot_time_s
    for index, delta in enumerate(deltas):
        due_s = begun_s + (index * TICK_S if times_s is None else times_s[index])
        while (snapshot := robot.observe()).robot_time_s < due_s - 1e-6:
            robot.clock.sleep_until(robot.clock.now_s() + 0.001)
        ack = robot.command(Command(next(number), snapshot.epoch, snapshot.position + delta, "keep"))
        assert ack.applied, ack
        seen.append(snapshot.position)
        sent_s.append(snapshot.robot_time_s - begun_s)
    return np.array(seen), np.array(sent_s)


def eventually(condition, limit_s):
    until_s = time.perf_counter() + limit_s
    while not condition():
        assert time.perf_counter() < until_s, "it did not come to pass"
        time.sleep(0.01)


def freeze_this_process(seconds):
    """Stop every thread of this process, the 1 kHz loop too, as a hung computer would."""
    script = f"kill -STOP {os.getpid()}; sleep {seconds}; kill -CONT {os.getpid()}"
    subprocess.run(["sh", "-c", script], check=True)


def test_the_rig_fits_its_sockets_and_every_check_passes(rig):
    assert isinstance(rig.robot, Robot)
    assert isinstance(rig.perception, Perception)
    assert isinstance(rig.stage, Stage)
    info = rig.robot.connect(10.0)
    assert info.kind == "twin"
    assert len(info.checks) == 8
    assert all(check.passed for check in info.checks)


def test_it_holds_where_its_own_joints_put_it(rig):
    time.sleep(0.3)
    first = rig.robot.observe()
    by_joints = (flange_pose(first.joint_angles) @ hand_frame())[:3, 3]
    np.testing.assert_allclose(first.position, by_joints, atol=0.001)
    np.testing.assert_allclose(np.abs(first.quaternion), [1, 0, 0, 0], atol=0.02)
    time.sleep(0.5)
    later = rig.robot.observe()
    assert np.linalg.norm(later.position - first.position) < 0.001
    assert later.mode == "move"
    assert later.robot_time_s > first.robot_time_s
    assert rig.robot.clock.now_s() - later.host_time_s < 0.05


def test_it_goes_to_its_home_and_opens_its_hand(rig):
    rig.robot.reset((0.45, 0.0, 0.20), "open", 15.0)
    assert np.linalg.norm(rig.robot.observe().position - [0.45, 0.0, 0.20]) < 0.006
    eventually(lambda: rig.robot.observe().gripper_width_m > 0.075, 3.0)
    rig.robot.reset((0.45, 0.0, 0.20), "close", 15.0)
    eventually(lambda: rig.robot.observe().gripper_width_m < 0.005, 3.0)
    assert rig.robot.observe().gripper_refusals == 0


def test_what_is_old_wild_or_too_far_is_refused(rig):
    now = rig.robot.observe()
    here, numbers = now.position, itertools.count(10)

    def answer(position, epoch=now.epoch):
        return rig.robot.command(Command(next(numbers), epoch, np.asarray(position, float), "keep")).refusal

    assert answer(here) == ""
    assert rig.robot.command(Command(10, now.epoch, here, "keep")).refusal == "sequence"
    assert answer(here, now.epoch - 1) == "epoch"
    assert answer([np.nan, 0, 0]) == "not_finite"
    assert answer(here + np.array([0.05, 0.0, 0.0])) == "lead"
    assert answer([0.9, 0.0, 0.2]) == "box"
    rig.robot.stop("test")
    assert answer(here) == "stopped"


def test_it_moves_as_the_fast_twin_does(rig):
    """Two seconds of the same deltas: the two TCPs stay within 5 mm of each other."""
    fast = registry.robot("twin").make(f"franka/{TASK}", None)
    fast.robot.connect(1.0)
    random = np.random.default_rng(3)
    turns = np.repeat(random.uniform(-1, 1, (6, 3)) * [0.008, 0.008, 0.006], 10, axis=0)
    paths, times_s = [], None
    for robot in (rig.robot, fast.robot):
        for height_m in (0.25, 0.20):  # the last way is the same for both, so friction holds them alike
            robot.reset((0.45, 0.0, height_m), "close", 15.0)
        seen, times_s = drive(robot, turns, itertools.count(1000), times_s)
        paths.append(seen - seen[0])
    apart = np.linalg.norm(paths[0] - paths[1], axis=1)
    assert np.ptp(paths[0], axis=0).max() > 0.02
    assert apart.max() < 0.005, apart.round(4)


def test_a_frozen_computer_costs_a_reflex_and_nothing_old_acts_after_it(rig):
    before = rig.robot.observe()
    drive(rig.robot, np.tile([0.0, 0.0, 0.004], (5, 1)), itertools.count(100))
    freeze_this_process(0.08)
    eventually(lambda: rig.robot.observe().mode == "reflex", 1.0)
    hit = rig.robot.observe()
    assert hit.epoch > before.epoch
    assert rig.robot.command(Command(500, before.epoch, hit.position, "keep")).refusal == "reflex"
    recovery = rig.robot.recover(10.0)
    assert (recovery.recovered, recovery.reconnect) == (True, False)
    assert "communication_constraints_violation" in recovery.reason
    after = rig.robot.observe()
    assert after.epoch > hit.epoch
    assert rig.robot.command(Command(501, hit.epoch, after.position, "keep")).refusal == "epoch"
    time.sleep(0.2)
    assert rig.robot.observe().mode == "move"
    assert np.linalg.norm(rig.robot.observe().position - hit.position) < 0.003


def test_scenes_are_laid_out_and_seen_as_the_fast_twin_lays_them_out(rig):
    world = World(TASK, START_SEED)
    rig.robot.reset((0.45, 0.0, 0.20), "close", 15.0)
    for start in (3, 4):
        world.place(start)
        rig.stage.arrange(start)
        eventually(lambda: not np.allclose(rig.stage.truth().object, 0), 1.0)
        np.testing.assert_allclose(rig.stage.truth().object, world.truth().object, atol=2e-4)
        seen = rig.perception.look(rig.robot.observe(), rig.robot.clock.now_s())
        np.testing.assert_allclose(seen["button"].position, world.surveyed()["button"], atol=2e-4)
        assert seen["button"].seen_s == np.inf


def test_a_server_that_dies_is_noticed_and_a_new_one_is_connected_to(tmp_path):
    address = next(ADDRESSES)
    plugin = registry.robot("twin")
    with served(TASK, address, START_SEED, tmp_path / "first.log") as running:
        rig = plugin.make(f"franka/{TASK}", address)
        rig.robot.connect(10.0)
        running.process.send_signal(signal.SIGKILL)
        eventually(lambda: rig.robot.observe().mode == "disconnected", 3.0)
        last = rig.robot.observe()
        assert rig.robot.command(Command(1, last.epoch, last.position, "keep")).refusal == "disconnected"
        assert rig.robot.recover(1.0).reconnect
        with pytest.raises(RobotError):
            rig.robot.connect(2.0)
        end(running.process)
    with served(TASK, address, START_SEED, tmp_path / "second.log"):
        rig.robot.connect(10.0)
        assert rig.robot.observe().mode in ("move", "idle")
        rig.robot.close()
        rig.stage.close()


def test_nobody_there_is_said_with_the_cure():
    rig = registry.robot("twin").make(f"franka/{TASK}", next(ADDRESSES))
    with pytest.raises(RobotError, match=r"Franka at 127\."):
        rig.robot.connect(2.0)
    assert rig.robot.observe().mode == "disconnected"
    rig.robot.stop("nothing to stop")
    rig.robot.close()
    rig.stage.close()
