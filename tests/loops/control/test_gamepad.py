import os
import struct

import numpy as np
import pytest

from hcpg.loops.control.gamepad import Gamepad
from hcpg.loops.control.keyboard import DeviceError

NOTHING = np.zeros(19)


def event(value, kind, number):
    return struct.pack("IhBB", 0, value, kind, number)


@pytest.fixture
def pad(tmp_path):
    """A pipe in the place of the device, and its writing end."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    reading = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    writing = os.open(path, os.O_WRONLY)
    yield path, writing
    os.close(reading)


def test_sticks_and_buttons_by_hand(pad):
    path, writing = pad
    with Gamepad(4, speed=0.5, device=path) as hand:
        assert hand(NOTHING, 2, 0).tolist() == [[0, 0, 0, 0]] * 2
        # Left stick wholly up and half to the left, right stick within its dead zone, button B.
        told = [event(-32768, 2, 1), event(-16384, 2, 0), event(3000, 2, 4), event(1, 1, 1)]
        os.write(writing, b"".join(told))
        assert hand(NOTHING, 1, 1)[0] == pytest.approx([0.5, 0.25, 0.0, 1.0], abs=1e-4)
        os.write(writing, event(0, 1, 1) + event(0, 0x80 | 2, 1) + event(1, 1, 0))
        assert hand(NOTHING, 1, 2)[0] == pytest.approx([0.0, 0.25, 0.0, -1.0], abs=1e-4)
    os.close(writing)


def test_an_event_may_arrive_in_two_parts(pad):
    path, writing = pad
    whole = event(32767, 2, 4)
    with Gamepad(3, device=path) as hand:
        os.write(writing, whole[:3])
        assert hand(NOTHING, 1, 0).tolist() == [[0, 0, 0]]
        os.write(writing, whole[3:])
        assert hand(NOTHING, 1, 1).tolist() == [[0, 0, -1]]
    os.close(writing)


def test_a_gamepad_that_is_pulled_out_is_told(pad):
    path, writing = pad
    with Gamepad(3, device=path) as hand:
        os.close(writing)
        with pytest.raises(DeviceError, match="is gone"):
            hand(NOTHING, 1, 0)


def test_no_gamepad_is_told(tmp_path):
    with pytest.raises(DeviceError, match=r"no gamepad can be read at .*plug a gamepad in"):
        Gamepad(3, device=tmp_path / "js7")
