"""A robot that goes wrong on purpose, around any other: to see what the control loop makes of it."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from hcpg.interfaces import Clock, Robot
from hcpg.robot_types import Ack, Command, Grip, Info, Limits, Mode, Recovery, RobotError, Snapshot
from hcpg.safety.gate import Gate
from hcpg.types import Float


@dataclass
class Wrong:
    """What is wrong at the moment; whoever injects faults sets it, at any time."""

    frozen: bool = False
    """No new state arrives, until the next connect."""
    repeated: bool = False
    """States arrive, and all are the last one: new arrival times, old controller time."""
    not_finite: bool = False
    """The measured position is NaN."""
    mode: Mode | None = None
    """What the controller claims to do; `reflex` and `disconnected` last until recovered or connected."""
    grip_refused: bool = False
    command_delay_s: float = 0.0
    command_loss: float = 0.0
    """Share of the commands that get lost, in [0, 1]."""
    recover_s: float = 0.0
    """How long each recovery takes."""
    recoveries_failing: int = 0
    connects_failing: int = 0


@dataclass
class Seen:
    """What went to the arm and where it was, counted beside the loop."""

    applied: int = 0
    """Commands that reached the arm."""
    applied_while_wrong: int = 0
    """Of these, while the controller was in a reflex, disconnected or stopped, injected or truly."""
    refused: dict[str, int] = field(default_factory=dict)
    """Commands that were not let through, by reason."""
    position: Float[np.ndarray, " 3"] | None = None
    """Where the arm really was at the last look, m."""
    furthest_outside_m: float = 0.0
    """Of every position that was measured, outside the box."""


class FaultyRobot:
    """Passes everything on to `robot`, as far as nothing is wrong."""

    def __init__(self, robot: Robot, seed: int = 0) -> None:
        self.wrong, self.seen = Wrong(), Seen()
        self._robot, self._random = robot, np.random.default_rng(seed)
        self._gate = Gate(robot.limits)
        self._travelling: deque[tuple[float, Command]] = deque()
        self._grip_refusals = 0
        self._last: Snapshot | None = None

    @property
    def limits(self) -> Limits:
        """The robot's."""
        return self._robot.limits

    @property
    def clock(self) -> Clock:
        """The robot's."""
        return self._robot.clock

    def strike(self, mode: Mode) -> None:
        """Go into `mode` by itself, as in a reflex or when the cable is cut."""
        self.wrong.mode = mode
        self._gate.advance()
        self._robot.hold()

    def connect(self, timeout_s: float) -> Info:
        """Connect, unless that is to fail.

        Raises:
            RobotError: it is to fail, or the robot's own reason.
        """
        if self.wrong.connects_failing > 0:
            self.wrong.connects_failing -= 1
            raise RobotError("nobody answers (injected)")
        info = self._robot.connect(timeout_s)
        self.wrong.mode, self.wrong.frozen = None, False
        self._gate.open()
        return info

    def observe(self) -> Snapshot:
        """The state as it (wrongly) seems, after what travels has arrived."""
        self._deliver()
        true = self._robot.observe()
        self.seen.position = true.position
        beyond = true.position - np.clip(true.position, self.limits.box_low_m, self.limits.box_high_m)
        self.seen.furthest_outside_m = max(self.seen.furthest_outside_m, float(np.linalg.norm(beyond)))
        if self._last is not None and self.wrong.frozen:
            return self._last
        if self._last is not None and self.wrong.repeated:
            return self._last._replace(host_time_s=true.host_time_s, sequence=self._last.sequence - 1)
        self._last = self._dressed(true)
        return self._last

    def command(self, command: Command) -> Ack:
        """Take the command in; it reaches the arm after the delay, if it is not lost."""
        refusal = self._refusal()
        if refusal is not None:
            return self._refused(refusal)
        if self._random.uniform() < self.wrong.command_loss:
            return Ack(True, "")
        if self.wrong.grip_refused and command.grip != "keep":
            self._grip_refusals += 1
            command = command._replace(grip="keep")
        if self.wrong.command_delay_s:
            self._travelling.append((self.clock.now_s() + self.wrong.command_delay_s, command))
            return Ack(True, "")
        return self._passed_on(command)

    def hold(self) -> None:
        """As the robot."""
        self._robot.hold()

    def stop(self, reason: str) -> None:
        """As the robot."""
        self._gate.close()
        self._robot.stop(reason)

    def recover(self, timeout_s: float) -> Recovery:
        """Recover, after the time it is to take."""
        self.clock.sleep_until(self.clock.now_s() + self.wrong.recover_s)
        if self.wrong.mode == "disconnected":
            return Recovery(False, True, "the connection is gone (injected)")
        if self.wrong.recoveries_failing > 0:
            self.wrong.recoveries_failing -= 1
            return Recovery(False, False, "the errors stay (injected)")
        self.wrong.mode = None
        self._gate.advance()
        if self._robot.observe().mode == "reflex":
            return self._robot.recover(timeout_s)
        self._robot.hold()
        return Recovery(not self._gate.closed, self._gate.closed, "the injected reflex is cleared")

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """As the robot, if nothing is wrong.

        Raises:
            RobotError: a wrong mode, or the robot's own reason.
        """
        if self.wrong.mode is not None:
            raise RobotError(f"the robot is in mode {self.wrong.mode} (injected)")
        self._gate.advance()
        self._robot.reset(position, grip, timeout_s)

    def close(self) -> None:
        """As the robot."""
        self._gate.close()
        self._robot.close()

    def _dressed(self, true: Snapshot) -> Snapshot:
        position = np.full(3, np.nan) if self.wrong.not_finite else true.position
        refusals = true.gripper_refusals + self._grip_refusals
        mode = self.wrong.mode or true.mode
        return true._replace(epoch=self._gate.epoch, position=position, gripper_refusals=refusals, mode=mode)

    def _refusal(self) -> Ack | None:
        if self.wrong.mode == "reflex":
            return Ack(False, "reflex")
        return Ack(False, "disconnected") if self.wrong.mode == "disconnected" else None

    def _refused(self, ack: Ack) -> Ack:
        self.seen.refused[ack.refusal] = self.seen.refused.get(ack.refusal, 0) + 1
        return ack

    def _deliver(self) -> None:
        while self._travelling and self._travelling[0][0] <= self.clock.now_s():
            self._passed_on(self._travelling.popleft()[1])

    def _passed_on(self, command: Command) -> Ack:
        """Through a gate of its own, since epochs here count the injected faults too."""
        true = self._robot.observe()
        inner: list[Ack] = []

        def send(each: Command) -> None:
            inner.append(self._robot.command(each._replace(epoch=true.epoch)))

        ack = self._gate.apply(command, true.position, send)
        final = inner[0] if ack.applied else ack
        if not final.applied:
            return self._refused(final)
        self.seen.applied += 1
        self.seen.applied_while_wrong += (self.wrong.mode or true.mode) not in ("idle", "move")
        return final
