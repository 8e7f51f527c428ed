"""Look at a robot without moving it: its checks, its states, and how well this machine keeps 30 Hz."""

from typing import NamedTuple

import numpy as np

from hcpg.interfaces import Robot
from hcpg.loops.control.deadlines import Deadlines, Timing
from hcpg.loops.control.states import Freshness
from hcpg.loops.control.stopping import StopButton
from hcpg.robot_types import Info, Mode
from hcpg.safety.limiting import outside_m

LEAST_SUCCESS_RATE = 0.95
"""Of the commands that reach the controller in time."""


class Watched(NamedTuple):
    """What was seen while the arm held."""

    info: Info
    timing: Timing
    state_age_max_ms: float
    state_age_bound_ms: float
    """Beyond it, a session holds."""
    body_max_ms: float
    """The longest that looking and holding took."""
    success_rate_min: float
    modes: tuple[Mode, ...]
    """All that occurred, in order of appearance."""
    moved_mm: float
    """The furthest from where it was at first."""
    outside_mm: float
    """Of the box, at the first look."""
    signal: int | None
    """The signal that ended it early, if one did."""

    @property
    def sound(self) -> bool:
        """Whether checks passed, the arm held inside its box, states came in time, deadlines were kept."""
        passed = all(check.passed for check in self.info.checks)
        still = self.outside_mm == 0.0 and set(self.modes) <= {"idle", "move"}
        heard = (
            self.state_age_max_ms <= self.state_age_bound_ms and self.success_rate_min >= LEAST_SUCCESS_RATE
        )
        return passed and still and heard and self.timing.sound and self.signal is None


def watch(robot: Robot, seconds: float, connect_s: float = 10.0) -> Watched:
    """Connect, hold for `seconds` or until a signal comes, and let go.

    Raises:
        RobotError: it cannot be connected; the message says the cure.
    """
    try:
        with StopButton(robot) as button:
            info = robot.connect(connect_s)
            return _held(robot, info, seconds, button)
    finally:
        robot.stop("the check ends")
        robot.close()


def _held(robot: Robot, info: Info, seconds: float, button: StopButton) -> Watched:
    deadlines, freshness, clock = Deadlines(robot.clock, robot.limits.rate_hz), Freshness(), robot.clock
    first = robot.observe()
    ages, bodies, rates, moved = [0.0], [0.0], [1.0], [0.0]
    modes: dict[Mode, None] = {}
    end_s = clock.now_s() + seconds
    while clock.now_s() < end_s and not button.reason:
        tick = deadlines.wait()
        snapshot = robot.observe()
        robot.hold()
        modes[snapshot.mode] = None
        ages.append(freshness.age_s(snapshot, clock.now_s()))
        rates.append(snapshot.success_rate)
        moved.append(float(np.linalg.norm(snapshot.position - first.position)))
        bodies.append(clock.now_s() - tick.woke_s)
    return Watched(
        info=info,
        timing=deadlines.timing(),
        state_age_max_ms=1000 * max(ages),
        state_age_bound_ms=1000 * robot.limits.stale_hold_s,
        body_max_ms=1000 * max(bodies),
        success_rate_min=min(rates),
        modes=tuple(modes),
        moved_mm=1000 * max(moved),
        outside_mm=1000 * outside_m(first.position, robot.limits),
        signal=button.signal,
    )
