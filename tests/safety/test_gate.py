import threading

import numpy as np
import pytest

from hcpg.robot_types import Ack, Command, Limits
from hcpg.safety.gate import Gate

LIMITS = Limits(box_low_m=(-0.5, -0.5, -0.5), box_high_m=(0.5, 0.5, 0.5), lead_m=0.02)
HERE = np.zeros(3)


class Arm:
    """A gate and what it let through."""

    def __init__(self):
        self.gate, self.sent = Gate(LIMITS), []
        self.gate.open()

    def command(self, sequence=0, epoch=None, position=(0.01, 0, 0), measured=HERE):
        wanted = Command(sequence, self.gate.epoch if epoch is None else epoch, np.asarray(position), "keep")
        return self.gate.apply(wanted, measured, self.sent.append)


def test_a_new_gate_is_closed():
    gate = Gate(LIMITS)
    assert gate.apply(Command(0, gate.epoch, HERE, "keep"), HERE, pytest.fail) == Ack(False, "stopped")


def test_a_good_command_is_sent_once():
    arm = Arm()
    assert arm.command(5) == Ack(True, "")
    assert [each.sequence for each in arm.sent] == [5]
    assert arm.command(5) == Ack(False, "sequence")
    assert arm.command(4) == Ack(False, "sequence")
    assert arm.command(6) == Ack(True, "")


def test_a_command_of_an_older_epoch_is_never_sent():
    arm = Arm()
    before = arm.gate.epoch
    assert arm.gate.advance() == before + 1
    assert arm.command(1, epoch=before) == Ack(False, "epoch")
    assert arm.sent == []
    assert arm.command(1) == Ack(True, "")


def test_a_stop_refuses_everything_until_the_next_connect():
    arm = Arm()
    before = arm.gate.epoch
    arm.gate.close()
    arm.gate.close()
    assert arm.command(1) == Ack(False, "stopped")
    assert arm.gate.open() > before
    assert arm.command(1, epoch=before) == Ack(False, "epoch")
    assert arm.command(0) == Ack(True, "")  # numbers begin anew with a connect


@pytest.mark.parametrize(
    ("position", "measured", "refusal"),
    [
        ((np.nan, 0, 0), HERE, "not_finite"),
        ((np.inf, 0, 0), HERE, "not_finite"),
        ((0.0, 0.0), HERE, "not_finite"),
        ((0.01, 0, 0), np.full(3, np.nan), "not_finite"),
        ((0.505, 0, 0), np.array([0.495, 0, 0]), "box"),
        ((0.021, 0, 0), HERE, "lead"),
        ((0.019, 0, 0), HERE, ""),
        ((0.52, 0, 0), np.array([0.53, 0, 0]), ""),  # on the way back in
        ((0.54, 0, 0), np.array([0.53, 0, 0]), "box"),
    ],
)
def test_wild_targets_are_refused(position, measured, refusal):
    arm = Arm()
    assert arm.command(0, position=position, measured=measured) == Ack(not refusal, refusal)
    assert len(arm.sent) == (not refusal)


def test_a_refused_command_does_not_use_up_its_number():
    arm = Arm()
    assert arm.command(1, position=(1.0, 0, 0)).refusal == "box"
    assert arm.command(1) == Ack(True, "")


def test_a_stop_while_a_command_is_being_sent_is_told():
    arm = Arm()
    command = Command(0, arm.gate.epoch, np.array([0.01, 0, 0]), "keep")
    assert arm.gate.apply(command, HERE, lambda _: arm.gate.close()) == Ack(False, "stopped")


def test_a_new_epoch_waits_for_the_command_being_sent_and_a_stop_does_not():
    arm = Arm()
    begun, may_end, order = threading.Event(), threading.Event(), []

    def send(_):
        begun.set()
        may_end.wait(5)
        order.append("sent")

    command = Command(0, arm.gate.epoch, np.array([0.01, 0, 0]), "keep")
    sender = threading.Thread(target=arm.gate.apply, args=(command, HERE, send))
    advancer = threading.Thread(target=lambda: (arm.gate.advance(), order.append("advanced")))
    sender.start()
    assert begun.wait(5)
    advancer.start()
    arm.gate.close()
    order.append("closed")
    may_end.set()
    sender.join(5)
    advancer.join(5)
    assert order[0] == "closed"
    assert order.index("sent") < order.index("advanced")
