"""A person with a SpaceMouse moves the arm; the device is read by pyspacemouse."""

from importlib import import_module
from typing import Any

import numpy as np

from hcpg.loops.control.gamepad import pushed
from hcpg.loops.control.keyboard import DeviceError
from hcpg.types import Float

HELP = "push the cap where the hand shall go; left button closes, right button opens; Ctrl-C stops"
GRIPS = (-1.0, 1.0)
"""What the first two buttons ask for: close, open."""
MOST_REPORTS = 64
"""Reports read at one tick: the device sends some eight in that time, so more are those of a stall."""


class SpaceMouse:
    """Proposals from the cap's translation, not its rotation; used as a block, which closes the device."""

    def __init__(self, action_size: int, speed: float = 1.0) -> None:
        """Take the first SpaceMouse there is; `speed` in (0, 1] is the part of a full step at full travel.

        Raises:
            DeviceError: the library or the device is not there, or this user may not read it.
        """
        self._size, self._speed, self._grip = action_size, speed, 0.0
        self._device = _opened()

    def __enter__(self) -> "SpaceMouse":
        return self

    def __exit__(self, *_: object) -> None:
        self._device.close()

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """What the cap asks for now, `count` times; never waits.

        Raises:
            DeviceError: the SpaceMouse is gone.
        """
        state = self._newest()
        cap = np.array([state.x, state.y, state.z])
        for pressed, grip in zip(state.buttons, GRIPS, strict=False):  # some have more buttons
            self._grip = grip if pressed else self._grip
        return pushed(cap, self._speed, self._grip, (count, self._size))

    def _newest(self) -> Any:
        """The state after every report that has arrived; one read takes in one report."""
        try:
            state = self._device.read()
            for _ in range(MOST_REPORTS):
                before = state.t
                state = self._device.read()
                if state.t == before:
                    break
        except OSError as error:
            raise DeviceError(f"the SpaceMouse is gone ({error}); plug it in") from error
        return state


def _opened() -> Any:
    """The device, with the axes of the arm's base: x away from it, y to its left, z up."""
    try:
        pyspacemouse = import_module("pyspacemouse")  # an extra: type checkers need not have it
    except (ImportError, OSError) as error:  # OSError: hidapi's own library is missing
        raise DeviceError(
            f"a SpaceMouse cannot be read here ({error}): install hcpg-flow[spacemouse] and the system's "
            "libhidapi-hidraw0, or take another --source"
        ) from error
    try:
        return pyspacemouse.open(axis_convention=pyspacemouse.AxisConvention.ROS)
    except (RuntimeError, OSError) as error:
        raise DeviceError(
            f"no SpaceMouse can be read ({error}): plug one in, let this user read /dev/hidraw*, "
            "or take another --source"
        ) from error
