"""The last look at a command, inside the driver: nothing old, nothing wild reaches the arm.

The control loop limits what it sends; a driver's gate refuses whatever comes all the same. Epochs make old
commands harmless: a command names the epoch of the snapshot it answers, and every connect, reset, reflex,
recovery and stop begins a new one.
"""

import threading
from collections.abc import Callable

import numpy as np

from hcpg.robot_types import Ack, Command, Limits, Refusal
from hcpg.types import Float, Tensor

_SLACK_M = 1e-6


class Gate:
    """Admits commands of the running epoch, each sequence number once, inside the box and the lead.

    It starts closed. `close` takes no lock, so a signal handler may call it whatever is interrupted.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._lock = threading.RLock()
        self._epoch, self._newest, self._closed = 0, -1, True

    @property
    def epoch(self) -> int:
        """The running epoch, for the driver's snapshots."""
        return self._epoch

    @property
    def closed(self) -> bool:
        """Whether every command is refused: before `open` and after `close`."""
        return self._closed

    def open(self) -> int:
        """Admit commands (again), as of a connect; sequence numbers begin anew. Gives the new epoch."""
        with self._lock:
            self._closed, self._newest = False, -1
            return self.advance()

    def advance(self) -> int:
        """Begin a new epoch and give it; a command of an older one is not being sent when this returns."""
        with self._lock:
            self._epoch += 1
            return self._epoch

    def close(self) -> None:
        """Refuse everything from now on, as of a stop; safe from any thread and signal handler."""
        self._closed = True
        self._epoch += 1

    def apply(self, command: Command, measured: Float[Tensor, " 3"], send: Callable[[Command], None]) -> Ack:
        """Pass `command` to `send` unless it has to be refused; `measured` is the newest position, m."""
        with self._lock:
            refusal = self._refusal(command, measured)
            if refusal:
                return Ack(False, refusal)
            self._newest = command.sequence
            send(command)
        return Ack(not self._closed, "stopped" if self._closed else "")

    def _refusal(self, command: Command, measured: Float[Tensor, " 3"]) -> Refusal:
        if self._closed:
            return "stopped"
        if command.epoch != self._epoch:
            return "epoch"
        if command.sequence <= self._newest:
            return "sequence"
        return self._place_refusal(np.asarray(command.position), np.asarray(measured))

    def _place_refusal(self, target: Float[np.ndarray, "..."], measured: Float[np.ndarray, "..."]) -> Refusal:
        if target.shape != (3,) or not np.isfinite([*target, *measured]).all():
            return "not_finite"
        if (self._beyond(target) > self._beyond(measured) + _SLACK_M).any():
            return "box"  # where the arm itself is outside, a target on the way back is welcome
        if np.linalg.norm(target - measured) > self._limits.lead_m + _SLACK_M:
            return "lead"
        return ""

    def _beyond(self, position: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
        return np.abs(position - np.clip(position, self._limits.box_low_m, self._limits.box_high_m))
