"""The gripper: slow, and spoken to in a thread of its own, so that the arm never waits for it."""

import time
from typing import Any, NamedTuple

from hcpg.robot_types import Grip
from hcpg.safety.newest import Newest

POLL_S = 0.02
OPEN_M, BAND_M = 0.08, 0.08
"""A grasp closes until something stops the fingers; whatever the width is then, it counts as done."""


class HandState(NamedTuple):
    """What is known of the gripper."""

    width_m: float
    read_s: float
    refusals: int


class Hand:
    """Carries out the newest command, one at a time, and keeps reading the width."""

    def __init__(self, gripper: Any, speed_m_s: float, force_n: float) -> None:
        """`gripper` is franky's; the first width is read at once."""
        self._gripper: Any = gripper
        self._speed_m_s, self._force_n = speed_m_s, force_n
        self._wanted: Grip = "keep"
        self._begun: Grip = "keep"
        self._running: Any = None
        self._refusals = 0
        self.version, self.widest_m = int(gripper.server_version), float(gripper.max_width)
        self._newest = Newest(self._turn, "franka-hand")

    @property
    def state(self) -> HandState:
        """The newest; commands to a hand that is not connected any more count as refused."""
        return self._newest.value._replace(refusals=self._refusals)

    def ask(self, grip: Grip) -> None:
        """Open or close as soon as the hand is free; a later command replaces one that has not begun."""
        if grip != "keep":
            self._refusals += self._newest.error is not None and grip != self._wanted
            self._wanted = grip

    def close(self, timeout_s: float) -> None:
        """End the thread, and wait for a running command; the fingers stay as they are."""
        self._newest.close(timeout_s)
        if self._running is not None:
            self._running.wait(timeout_s)
        self._gripper = self._running = None  # the connection ends with the last reference

    def _turn(self) -> HandState:
        time.sleep(POLL_S)
        if self._running is not None and self._running.wait(0.0):
            self._settle()
        if self._running is None and self._wanted != self._begun:
            self._begun = self._wanted
            self._running = self._begin(self._begun)
        return HandState(float(self._gripper.state.width), time.perf_counter(), self._refusals)

    def _begin(self, grip: Grip) -> Any:
        if grip == "open":
            return self._gripper.move_async(OPEN_M, self._speed_m_s)
        return self._gripper.grasp_async(0.0, self._speed_m_s, self._force_n, BAND_M, BAND_M)

    def _settle(self) -> None:
        """Count a command that failed, or that the hand refused."""
        try:
            self._refusals += not self._running.get()
        except Exception:  # franky has several kinds; each means that the fingers did not do as asked
            self._refusals += 1
        self._running = None
