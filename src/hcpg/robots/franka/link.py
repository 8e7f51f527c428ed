"""One connection to a Franka controller: the 1 kHz loop in franky's C++, the newest state, the hand."""

import importlib
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hcpg.robot_types import Limits, Mode, RobotError
from hcpg.robots.franka.hand import Hand
from hcpg.robots.franka.kinematics import flange_pose
from hcpg.robots.franka.setup import Setup, hand_frame
from hcpg.safety.newest import Newest
from hcpg.types import Float

STATE_S = 0.004
"""Between two looks at the state."""
STARTS_S = 1.0
"""Within this time a controller that was started is in control."""
LEAST_RATE = 0.5
"""Of the commands that reach a controller in time: what it counts once it has started."""
DOWN = np.array([1.0, 0.0, 0.0, 0.0])
"""The hand's fixed nominal orientation: pointing down, fingers opening along the base's y."""
AGREES_M = 0.002
MODES: dict[str, Mode] = {
    "Idle": "idle",
    "Move": "move",
    "Guiding": "guiding",
    "Reflex": "reflex",
    "UserStopped": "user_stopped",
    "AutomaticErrorRecovery": "recovering",
}


class Reading(NamedTuple):
    """One look at the controller's state."""

    state: Any
    """franky's `RobotState`."""
    number: int
    """How many different states were seen."""
    read_s: float
    """When this state was first seen, on this machine's clock."""
    mode: Mode


class Link:
    """A connection under impedance control. `on_fault` is called when the controller stops by itself."""

    def __init__(self, address: str, setup: Setup, limits: Limits, on_fault: Callable[[], Any]) -> None:
        """Connect and set the controller up; nothing moves."""
        self._franky: Any = importlib.import_module("franky")
        self._setup, self._limits, self._on_fault = setup, limits, on_fault
        realtime = self._franky.RealtimeConfig
        self.robot: Any = self._franky.Robot(
            address, realtime_config=realtime.Enforce if setup.realtime else realtime.Ignore
        )
        self._tracker: Any = None
        self._fault: Mode | None = None
        self._count, self._time_ms, self._seen_s = 0, -1, 0.0
        self.reason = ""
        self.robot.set_collision_behavior(setup.collision_torque_nm, setup.collision_force_n)
        if setup.sets_frame:
            self._set_frame(hand_frame())
        self.states = Newest(self._read, "franka-states")
        self._posture = np.array(self.states.value.state.q)
        self.hand = Hand(self._franky.Gripper(address), setup.grip_speed_m_s, setup.grip_force_n)

    @property
    def mode(self) -> Mode:
        """What the controller does; `disconnected` once its states have ended."""
        return "disconnected" if self.states.error is not None else self.states.value.mode

    def follow(self) -> None:
        """Begin impedance control around where the arm is, in the posture of the connection's beginning.

        Raises:
            RobotError: the controller does not start, or loses most commands.
        """
        tracker = self._franky.CartesianImpedanceTracker(
            self.robot,
            translational_stiffness=self._limits.stiffness_n_m,
            rotational_stiffness=self._setup.rotation_nm_rad,
            translational_error_clip=np.full(3, self._limits.reach_m),
            rotational_error_clip=np.full(3, self._setup.turn_rad),
            posture_task=self._franky.PostureTask(self._posture, self._setup.posture_nm_rad),
        )
        _wait_for(lambda: self.robot.is_in_control, "the controller does not start; look at Desk")
        self._tracker, self._fault = tracker, None
        _wait_for(self._hears, "the controller hears too few commands; look at the network and the kernel")

    def aim(self, position: Float[np.ndarray, " 3"]) -> None:
        """Let the target be there; the 1 kHz loop takes it up in its next cycle."""
        if self._tracker is not None and self._fault is None:
            self._tracker.set_target(self._franky.Affine(np.asarray(position, np.float64), DOWN))

    def recover(self) -> None:
        """Clear the controller's errors and follow again.

        Raises:
            RobotError: the errors stay.
            Exception: what franky raises where the connection is gone or the controller refuses.
        """
        self._tracker = None
        self._forget_motion(STARTS_S)
        self.clear()
        self.follow()

    def clear(self) -> None:
        """Clear the controller's errors, and wait for a state from after that.

        Raises:
            RobotError: the errors stay.
        """
        if not self.robot.recover_from_errors():
            raise RobotError("its errors stay; look at Desk, then try again")
        self._fault, seen = None, self.states.value.number
        _wait_for(lambda: self.states.value.number >= seen + 2, "the controller sends no states")

    def end(self) -> None:
        """End the motion smoothly, in the background; safe to call again."""
        tracker, self._tracker = self._tracker, None
        if tracker is not None and self.robot.is_in_control:
            self.robot.move(self._franky.TorqueStopMotion(), asynchronous=True)

    def close(self, timeout_s: float) -> None:
        """End the motion and the threads, each waited for at most that long."""
        self.end()
        self.hand.close(timeout_s)
        self.states.close(timeout_s)
        self._forget_motion(timeout_s)
        self.robot = None  # its connection ends with the last reference to it

    def _hears(self) -> bool:
        """Whether the controller moves by our commands, and most of them reach it."""
        reading = self.states.value
        return reading.mode == "move" and reading.state.control_command_success_rate > LEAST_RATE

    def _read(self) -> Reading:
        time.sleep(STATE_S)
        state = self.robot.state
        time_ms = state.time.to_msec()
        if time_ms != self._time_ms:
            self._time_ms, self._count, self._seen_s = time_ms, self._count + 1, time.perf_counter()
        if self._tracker is not None and self._fault is None and not self.robot.is_in_control:
            self._fault = "reflex"
            self._on_fault()
            self._raise_if_disconnected()
        mode = self._fault or MODES.get(state.robot_mode.name, "other")
        return Reading(state, self._count, self._seen_s, mode)

    def _raise_if_disconnected(self) -> None:
        """Raise what ended the motion, if it was the network."""
        try:
            self.robot.poll_motion()
        except self._franky.ControlException as error:
            self.reason = str(error)

    def _forget_motion(self, timeout_s: float) -> None:
        """Wait for the motion's end, and take the exception of one that did not end well."""
        try:
            self.robot.join_motion(timeout_s)
        except (self._franky.ControlException, self._franky.NetworkException) as error:
            self.reason = str(error)

    def _set_frame(self, frame: Float[np.ndarray, "4 4"]) -> None:
        """Set the end effector's frame, and wait until the reported pose is that of the new one."""
        self.robot.set_ee(frame.T.flatten().tolist())
        until_s = time.perf_counter() + 1.0
        while time.perf_counter() < until_s:
            state = self.robot.state
            expected = flange_pose(np.array(state.q)) @ frame
            if np.linalg.norm(state.O_T_EE.translation - expected[:3, 3]) < AGREES_M:
                return
        raise RobotError("the controller does not take the end effector's frame; set it in Desk")


def _wait_for(condition: Callable[[], bool], otherwise: str) -> None:
    """Wait until the condition holds.

    Raises:
        RobotError: it does not hold within `STARTS_S`; the message is `otherwise`.
    """
    until_s = time.perf_counter() + STARTS_S
    while not condition():
        if time.perf_counter() > until_s:
            raise RobotError(otherwise)
        time.sleep(STATE_S)
