"""The robot socket over a Franka controller, real or simulated: the address is the only difference."""

import threading
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np

from hcpg.robot_types import Ack, Check, Command, Grip, Info, Limits, Recovery, RobotError, Snapshot
from hcpg.robots.franka.checks import checks
from hcpg.robots.franka.kinematics import point_velocity
from hcpg.robots.franka.link import DOWN, Link
from hcpg.robots.franka.setup import Setup
from hcpg.safety.clock import MachineClock
from hcpg.safety.gate import Gate
from hcpg.safety.way import Way

CLOSES_S = 2.0
"""Threads of a connection that is given up are waited for so long."""
NOWHERE = Snapshot(
    0, 0, 0.0, 0.0, np.full(3, np.nan), np.zeros(3), DOWN, np.zeros(7), None, 0.0, 0.0, 0, "disconnected", 0.0
)  # fmt: skip


class FrankaArm:
    """An FR3 with its hand. Its 1 kHz loop, in C++, holds whatever target was set last."""

    def __init__(self, address: str, limits: Limits, setup: Setup) -> None:
        self.limits, self.clock = limits, MachineClock()
        self._address, self._setup, self._gate = address, setup, Gate(limits)
        self._link: Link | None = None
        self._last, self._holds = NOWHERE, True

    def connect(self, timeout_s: float) -> Info:
        """Connect (again), check, hold still.

        Raises:
            RobotError: nobody answers, or a check failed; the message says which and the cure.
        """
        self._let_go()
        link, done = self._within(timeout_s, self._opened)
        self._link = link
        self._gate.open()
        self._stay()
        versions = {"franky": version("franky-control"), "gripper": str(link.hand.version)}
        return Info(f"Franka at {self._address}", self._setup.kind, versions, done)

    def observe(self) -> Snapshot:
        """The newest state, at once."""
        link = self._link
        if link is None:
            return self._last._replace(epoch=self._gate.epoch, mode="disconnected")
        reading, hand = link.states.value, link.hand.state
        state = reading.state
        position, angles = np.array(state.O_T_EE.translation), np.array(state.q)
        self._last = Snapshot(
            sequence=reading.number,
            epoch=self._gate.epoch,
            robot_time_s=float(state.time.to_sec()),
            host_time_s=reading.read_s,
            position=position,
            velocity=point_velocity(angles, np.array(state.dq), position),
            quaternion=np.array(state.O_T_EE.quaternion),
            joint_angles=angles,
            force=np.array(state.O_F_ext_hat_K)[:3] if self._setup.estimates_force else None,
            gripper_width_m=hand.width_m,
            gripper_time_s=hand.read_s,
            gripper_refusals=hand.refusals,
            mode=link.mode,
            success_rate=float(state.control_command_success_rate),
        )
        return self._last

    def command(self, command: Command) -> Ack:
        """Move the target there, unless the arm has stopped by itself or the gate refuses it."""
        snapshot = self.observe()
        if snapshot.mode in ("reflex", "disconnected"):
            return Ack(False, snapshot.mode)
        return self._gate.apply(command, snapshot.position, self._send)

    def hold(self) -> None:
        """The target becomes the measured position and stays there; no effect without connection."""
        if not self._holds and not self._gate.closed:
            self._stay()

    def stop(self, reason: str) -> None:
        """Hold, refuse whatever comes, let the motion run out."""
        self.hold()
        self._gate.close()
        link = self._link
        if link is not None:
            link.end()

    def recover(self, timeout_s: float) -> Recovery:
        """Clear a reflex and hold where the arm is now."""
        link = self._link
        if link is None or link.mode == "disconnected" or self._gate.closed:
            return Recovery(False, True, "the connection is gone; connect again")
        try:
            self._within(timeout_s, link.recover)
        except RobotError as error:
            return Recovery(False, link.mode == "disconnected", str(error))
        self._gate.advance()
        self._stay()
        return Recovery(True, False, link.reason)

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """Up, across and down to a start position, in steps of the limits' length.

        Raises:
            RobotError: it did not get there in time, or it stopped by itself.
        """
        link = self._link
        if link is None or self._gate.closed:
            raise RobotError("the robot is not connected; connect first")
        self._gate.advance()
        link.hand.ask(grip)
        way = Way(self.observe().position, np.array(position), self.limits.step_m)
        tick_s, until_s = self.clock.now_s(), self.clock.now_s() + timeout_s
        while (target := way.target(self._sound().position)) is not None:
            if self.clock.now_s() > until_s:
                self._stay()
                raise RobotError(f"the arm is not at its start after {timeout_s:g} s; see what blocks it")
            link.aim(target)
            tick_s += 1.0 / self.limits.rate_hz
            self.clock.sleep_until(tick_s)
        self._gate.advance()
        self._stay()

    def close(self) -> None:
        """Stop and let the connection go."""
        self.stop("closed")
        self._let_go()

    def _opened(self) -> tuple[Link, tuple[Check, ...]]:
        """A connection whose checks have passed, under impedance control."""
        link = Link(self._address, self._setup, self.limits, self._gate.advance)
        try:
            return link, self._started(link)
        except Exception:
            link.close(CLOSES_S)
            raise

    def _started(self, link: Link) -> tuple[Check, ...]:
        if link.mode == "reflex":
            link.clear()
        done = checks(link.states.value, link.hand.widest_m, self.limits, self._setup)
        failed = [each for each in done if not each.passed]
        if failed:
            raise RobotError("; ".join(f"{each.name}: no, {each.found}; {each.cure}" for each in failed))
        link.follow()
        return done

    def _sound(self) -> Snapshot:
        """The newest state of an arm that may move.

        Raises:
            RobotError: it has stopped by itself or was stopped, or says nothing new.
        """
        snapshot = self.observe()
        age_s = self.clock.now_s() - snapshot.host_time_s
        if self._gate.closed or snapshot.mode != "move" or age_s > self.limits.stale_end_s:
            raise RobotError(f"stopped on its way: mode {snapshot.mode}, state {age_s:.2f} s old")
        return snapshot

    def _send(self, command: Command) -> None:
        link = self._link
        if link is not None:
            link.aim(command.position)
            link.hand.ask(command.grip)
            self._holds = False

    def _stay(self) -> None:
        link = self._link
        if link is not None:
            link.aim(np.array(link.states.value.state.O_T_EE.translation))
            self._holds = True

    def _let_go(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            link.close(CLOSES_S)

    def _within(self, timeout_s: float, call: Callable[[], Any]) -> Any:
        """What `call` gives, made in a thread of its own so that it cannot hang.

        Raises:
            RobotError: it took longer, or it failed; the message says with what.
        """
        answers: list[Any] = []
        errors: list[Exception] = []

        def make() -> None:
            try:
                answers.append(call())
            except Exception as error:  # handed to whoever waits
                errors.append(error)

        thread = threading.Thread(target=make, name="franka-call", daemon=True)
        thread.start()
        thread.join(timeout_s)
        if errors:
            raise RobotError(f"Franka at {self._address}: {errors[0]}") from errors[0]
        if thread.is_alive():
            cure = "is it switched on, unlocked, and FCI activated?"
            raise RobotError(f"Franka at {self._address}: no answer in {timeout_s:g} s; {cure}")
        return answers[0]
