"""The hand's thread against a gripper that is slow, refuses, or goes away."""

import threading
import time
from types import SimpleNamespace

import pytest

from hcpg.robots.franka.hand import Hand


class Future:
    def __init__(self, gripper, width_m, result):
        self.gripper, self.width_m, self.result, self.done = gripper, width_m, result, threading.Event()

    def wait(self, timeout=None):
        return self.done.wait(timeout)

    def get(self):
        if isinstance(self.result, Exception):
            raise self.result
        return self.result

    def finish(self):
        self.gripper.width_m = self.width_m
        self.done.set()


class Gripper:
    server_version, max_width = 3, 0.08

    def __init__(self):
        self.width_m, self.asked, self.running, self.result, self.gone = 0.08, [], None, True, False

    @property
    def state(self):
        if self.gone:
            raise RuntimeError("UDP receive: Timeout")
        return SimpleNamespace(width=self.width_m)

    def move_async(self, width, speed):
        return self._begin("open", width)

    def grasp_async(self, width, speed, force, inner, outer):
        assert (force, outer) == (20.0, 0.08)
        return self._begin("close", 0.06)

    def _begin(self, name, width_m):
        self.asked.append(name)
        self.running = Future(self, width_m, self.result)
        return self.running


@pytest.fixture
def hand_and_gripper():
    gripper = Gripper()
    hand = Hand(gripper, 0.1, 20.0)
    yield hand, gripper
    if gripper.running is not None:
        gripper.running.finish()
    hand.close(1.0)


def eventually(condition):
    until_s = time.monotonic() + 2.0
    while not condition():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def test_asking_never_waits_and_the_newest_command_wins(hand_and_gripper):
    hand, gripper = hand_and_gripper
    begun_s = time.monotonic()
    hand.ask("close")
    assert time.monotonic() - begun_s < 0.01
    eventually(lambda: gripper.asked == ["close"])
    for grip in ("open", "close", "keep", "open"):
        hand.ask(grip)
    time.sleep(0.1)
    assert gripper.asked == ["close"]
    gripper.running.finish()
    eventually(lambda: gripper.asked == ["close", "open"])
    assert hand.state.width_m == 0.06
    assert hand.state.refusals == 0


def test_what_is_asked_again_is_done_once(hand_and_gripper):
    hand, gripper = hand_and_gripper
    for _ in range(10):
        hand.ask("close")
        time.sleep(0.01)
    gripper.running.finish()
    time.sleep(0.1)
    assert gripper.asked == ["close"]


@pytest.mark.parametrize("result", [False, RuntimeError("command not possible")])
def test_a_command_that_fails_is_counted(hand_and_gripper, result):
    hand, gripper = hand_and_gripper
    gripper.result = result
    hand.ask("open")
    eventually(lambda: gripper.asked == ["open"])
    gripper.running.finish()
    eventually(lambda: hand.state.refusals == 1)


def test_a_hand_that_is_gone_keeps_its_last_width_and_refuses(hand_and_gripper):
    hand, gripper = hand_and_gripper
    gripper.gone = True
    read_s = hand.state.read_s
    time.sleep(0.1)
    hand.ask("close")
    assert (hand.state.width_m, hand.state.refusals) == (0.08, 1)
    assert hand.state.read_s - read_s < 0.05
