"""An arm that is a point: no simulator, no network, on a clock of its own that jumps instead of waiting.

The TCP follows its target with a lag of 40 ms. What holds for every robot can be tried on it in no time; on
the machine's own clock it shows how well the loop keeps its deadlines there.
"""

import math
from collections.abc import Mapping

import numpy as np

from hcpg.interfaces import Clock, Rig
from hcpg.perception.truth import NoisyTruth, Poorness
from hcpg.robot_types import (
    Ack,
    Check,
    Command,
    Grip,
    Info,
    Kind,
    Limits,
    Mode,
    Recovery,
    RobotError,
    Snapshot,
)
from hcpg.safety.clock import MachineClock
from hcpg.safety.gate import Gate
from hcpg.types import Float

LIMITS = Limits(
    box_low_m=(-0.25, -0.25, 0.0), box_high_m=(0.25, 0.25, 0.35), step_m=0.02, speed_m_s=0.9, lead_m=0.025,
    stiffness_n_m=1000.0,
)  # fmt: skip
LAG_S = 0.04
GRIPPER_SPEED_M_S = 0.1
OPEN_M = 0.08
STATE_PERIOD_S = 0.001
REAL_TIME = "real-time"


class JumpingClock:
    """Time that passes only while somebody sleeps."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def now_s(self) -> float:
        """Simulated seconds."""
        return self._now_s

    def sleep_until(self, time_s: float) -> None:
        """Jump there; back never."""
        self._now_s = max(self._now_s, time_s)


class PointArm:
    """The arm; its state is worked out when somebody looks."""

    def __init__(self, clock: Clock | None = None) -> None:
        """On a clock that jumps, unless another is given."""
        self.limits, self.clock = LIMITS, clock or JumpingClock()
        self._gate = Gate(LIMITS)
        self._position, self._velocity = np.array([0.0, 0.0, 0.2]), np.zeros(3)
        self._target = self._position
        self._width_m, self._width_target_m = OPEN_M, OPEN_M
        self._moved_s, self._holds, self._connected = self.clock.now_s(), True, False

    def connect(self, timeout_s: float) -> Info:
        """Always succeeds."""
        self._connected = True
        self._gate.open()
        self._stay()
        inside = bool((self._position == np.clip(self._position, LIMITS.box_low_m, LIMITS.box_high_m)).all())
        check = Check(
            "inside the box", inside, f"TCP at {self._position.round(3).tolist()} m", "move it inside"
        )
        return Info("point", "twin", {}, (check,))

    def observe(self) -> Snapshot:
        """The state of now, in whole milliseconds."""
        self._move()
        now_s = self.clock.now_s()
        updates = math.floor(now_s / STATE_PERIOD_S + 1e-6)
        mode: Mode = "move" if self._connected else "disconnected"
        return Snapshot(
            sequence=updates, epoch=self._gate.epoch, robot_time_s=updates * STATE_PERIOD_S,
            host_time_s=now_s, position=self._position, velocity=self._velocity,
            quaternion=np.array([1.0, 0.0, 0.0, 0.0]), joint_angles=np.zeros(0), force=None,
            gripper_width_m=self._width_m, gripper_time_s=now_s, gripper_refusals=0, mode=mode,
            success_rate=1.0,
        )  # fmt: skip

    def command(self, command: Command) -> Ack:
        """Move the target."""
        self._move()
        return self._gate.apply(command, self._position, self._follow)

    def hold(self) -> None:
        """Stay where it is."""
        if not self._holds and not self._gate.closed:
            self._stay()

    def stop(self, reason: str) -> None:
        """Stay, and refuse commands until the next connect."""
        self._gate.close()
        self._stay()

    def recover(self, timeout_s: float) -> Recovery:
        """It has no reflexes; a new epoch begins all the same."""
        self._gate.advance()
        self._stay()
        return Recovery(not self._gate.closed, self._gate.closed, "there was nothing to clear")

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """Be there, with the fingers as asked, after a second.

        Raises:
            RobotError: it is stopped, or the position is outside its box.
        """
        if self._gate.closed:
            raise RobotError("the arm is stopped; connect again")
        if (np.clip(position, LIMITS.box_low_m, LIMITS.box_high_m) != position).any():
            raise RobotError(f"the start {position} is outside the box; mend the task's `home`")
        self._gate.advance()
        self.clock.sleep_until(self.clock.now_s() + 1.0)
        self._position = np.asarray(position, np.float64)
        self._width_m = self._width_target_m if grip == "keep" else OPEN_M * (grip == "open")
        self._width_target_m = self._width_m
        self._moved_s = self.clock.now_s()
        self._stay()

    def close(self) -> None:
        """Stop and be disconnected."""
        self.stop("closed")
        self._connected = False

    def _follow(self, command: Command) -> None:
        self._target, self._holds = command.position, False
        if command.grip != "keep":
            self._width_target_m = OPEN_M * (command.grip == "open")

    def _stay(self) -> None:
        self._move()
        self._target, self._holds = self._position, True

    def _move(self) -> None:
        """Bring the state up to now: a first-order lag, worked out exactly."""
        elapsed_s = self.clock.now_s() - self._moved_s
        left = (self._target - self._position) * math.exp(-elapsed_s / LAG_S)
        self._position, self._velocity = self._target - left, left / LAG_S
        travel = GRIPPER_SPEED_M_S * elapsed_s
        self._width_m += min(max(self._width_target_m - self._width_m, -travel), travel)
        self._moved_s = self.clock.now_s()


class PointStage:
    """Lays out one object on the table and one goal above it."""

    def __init__(self) -> None:
        self.arrange(0)

    def arrange(self, start: int) -> None:
        """The layout of start state `start`."""
        random = np.random.default_rng([0, start])
        self.places: Mapping[str, Float[np.ndarray, " 3"]] = {
            "object": random.uniform([-0.2, -0.2, 0.02], [0.2, 0.2, 0.02]),
            "goal": random.uniform([-0.2, -0.2, 0.1], [0.2, 0.2, 0.25]),
        }

    def close(self) -> None:
        """Nothing to let go of."""


class PointRobot:
    """The plug-in."""

    kind: Kind = "twin"

    def make(self, task: str, address: str | None) -> Rig:
        """The arm, with one object and one goal in sight; at `real-time` it lives on this machine's clock.

        Raises:
            RobotError: the task is none of the suite `point`, or the address is another.
        """
        if not task.startswith("point/"):
            raise RobotError(f"the point arm cannot do {task}; give it a task of the suite point")
        if address not in (None, REAL_TIME):
            raise RobotError(f"the point arm has no address {address!r}; give {REAL_TIME!r}, or none")
        stage = PointStage()
        arm = PointArm(None if address is None else MachineClock())
        return Rig(arm, NoisyTruth(lambda: stage.places, Poorness(dropouts=0.0), seed=0), stage)


ROBOT = PointRobot()
