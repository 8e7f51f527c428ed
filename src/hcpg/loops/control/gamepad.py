"""A person with a gamepad moves the arm: Linux' joystick events, read without any library."""

import os
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hcpg.loops.control.keyboard import DeviceError
from hcpg.types import Float

DEVICE = Path("/dev/input/js0")
AXES: Mapping[int, tuple[int, float]] = {1: (0, -1.0), 0: (1, -1.0), 4: (2, -1.0)}
"""Number of a stick's axis -> axis of the base frame and sign: left stick up is away from the base, its left
is left, right stick up is up. Sticks count down and right as positive."""
GRIPS: Mapping[int, float] = {0: -1.0, 1: 1.0}
"""Number of a button -> close, open."""
HELP = "left stick: away, back, left, right; right stick: up, down; A closes, B opens; Ctrl-C stops"
DEAD_ZONE = 0.1
"""A stick that is let go rests anywhere within this part of its travel."""
_EVENT = struct.Struct("IhBB")
"""Milliseconds, value, kind, number."""
_BUTTON, _AXIS, _FULL = 1, 2, 32767


def pushed(
    travel: Float[np.ndarray, " 3"], speed: float, grip: float, shape: tuple[int, int]
) -> Float[np.ndarray, "K A"]:
    """K times the action that sticks or a cap ask for, at a travel in [-1, 1]; none within the dead zone."""
    action = np.zeros(shape)
    action[:, :3] = speed * np.clip(np.where(np.abs(travel) > DEAD_ZONE, travel, 0.0), -1.0, 1.0)
    action[:, 3:] = grip
    return action


class Gamepad:
    """Proposals from the sticks; used as a block, which closes the device."""

    def __init__(self, action_size: int, speed: float = 1.0, device: Path = DEVICE) -> None:
        """`speed` in (0, 1] is the part of a full step that a stick's full travel asks for.

        Raises:
            DeviceError: there is no such device, or this user may not read it.
        """
        self._size, self._speed, self._device = action_size, speed, device
        self._sticks, self._grip, self._rest = np.zeros(3), 0.0, b""
        try:
            self._descriptor = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            cure = "plug a gamepad in, give its device with --device, or take another --source"
            raise DeviceError(f"no gamepad can be read at {device} ({error.strerror}): {cure}") from error

    def __enter__(self) -> "Gamepad":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """What the sticks ask for now, `count` times; never waits.

        Raises:
            DeviceError: the gamepad is gone.
        """
        self._read()
        return pushed(self._sticks, self._speed, self._grip, (count, self._size))

    def _read(self) -> None:
        while (events := self._waiting()) is not None:
            events = self._rest + events
            whole = len(events) - len(events) % _EVENT.size
            self._rest = events[whole:]
            for _, value, kind, number in _EVENT.iter_unpack(events[:whole]):
                self._take(value, kind, number)

    def _waiting(self) -> bytes | None:
        """The bytes that have arrived; None where there are none."""
        try:
            arrived = os.read(self._descriptor, 64 * _EVENT.size)
        except BlockingIOError:
            return None
        except OSError as error:
            raise DeviceError(
                f"the gamepad at {self._device} is gone ({error.strerror}); plug it in"
            ) from error
        if not arrived:
            raise DeviceError(f"the gamepad {self._device} is gone (its events ended); plug it in")
        return arrived

    def _take(self, value: int, kind: int, number: int) -> None:
        """An event; those that the driver sends at the start to tell the present state count alike."""
        if kind & _AXIS and number in AXES:
            axis, sign = AXES[number]
            self._sticks[axis] = sign * max(value, -_FULL) / _FULL
        if kind & _BUTTON and value and number in GRIPS:
            self._grip = GRIPS[number]
