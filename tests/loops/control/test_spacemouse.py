"""No SpaceMouse is here: its library is played by one that hands out the states written down."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hcpg.loops.control.keyboard import DeviceError
from hcpg.loops.control.spacemouse import SpaceMouse

NOTHING = np.zeros(19)


class Device:
    """Each read takes in one report, changes the one state there is, and says so by its time."""

    def __init__(self, reports):
        self.reports, self.is_closed = reports, False
        self.state = SimpleNamespace(t=-1.0, x=0.0, y=0.0, z=0.0, buttons=[0, 0])

    def read(self):
        if self.reports:
            vars(self.state).update(self.reports.pop(0), t=self.state.t + 1)
        return self.state

    def close(self):
        self.is_closed = True


@pytest.fixture
def plugged_in(monkeypatch):
    """What puts a device in the place of the library's."""

    def plug_in(device):
        library = ModuleType("pyspacemouse")
        library.AxisConvention = SimpleNamespace(ROS="x away, y left, z up")

        def open_(axis_convention):
            assert axis_convention == library.AxisConvention.ROS
            if device is None:
                raise RuntimeError("No device found")
            return device

        library.open = open_
        monkeypatch.setitem(sys.modules, "pyspacemouse", library)
        return device

    return plug_in


def test_cap_and_buttons_by_hand(plugged_in):
    device = plugged_in(Device([{"x": 0.2}, {"x": 0.8, "y": -1.2, "z": 0.05}]))
    with SpaceMouse(4, speed=0.5) as hand:
        # The last report counts; y beyond its bounds is one full step, z is within the dead zone.
        assert hand(NOTHING, 2, 0).tolist() == [[0.4, -0.5, 0.0, 0.0]] * 2
        device.reports += [{"x": 0.0, "y": 0.0, "buttons": [1, 0]}, {"buttons": [0, 0]}, {"z": -1.0}]
        hand(NOTHING, 1, 1)
        device.reports += [{"buttons": [0, 1]}]
        assert hand(NOTHING, 1, 2).tolist() == [[0.0, 0.0, -0.5, 1.0]]
    assert device.is_closed


def test_no_more_reports_are_read_at_a_tick_than_a_stall_can_leave(plugged_in):
    device = plugged_in(Device([{"x": 0.5}] * 100))
    with SpaceMouse(3) as hand:
        hand(NOTHING, 1, 0)
    assert len(device.reports) == 100 - 65


def test_one_that_is_pulled_out_is_told(plugged_in):
    device = plugged_in(Device([]))
    with SpaceMouse(3) as hand:
        device.read = lambda: (_ for _ in ()).throw(OSError("read error"))
        with pytest.raises(DeviceError, match=r"is gone \(read error\)"):
            hand(NOTHING, 1, 0)


def test_no_device_and_no_library_are_told(plugged_in, monkeypatch):
    plugged_in(None)
    with pytest.raises(DeviceError, match=r"no SpaceMouse can be read \(No device found\): plug one in"):
        SpaceMouse(3)
    monkeypatch.setitem(sys.modules, "pyspacemouse", None)
    with pytest.raises(DeviceError, match=r"install hcpg-flow\[spacemouse\]"):
        SpaceMouse(3)
