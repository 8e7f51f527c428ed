"""The fast twin's arm: the robot socket over a world whose time runs when it is waited for."""

from importlib.metadata import version

import numpy as np

from hcpg.robot_types import Ack, Check, Command, Grip, Info, Limits, Recovery, RobotError, Snapshot
from hcpg.safety.gate import Gate
from hcpg.safety.way import Way
from hcpg.twin.limits import limits
from hcpg.twin.world import World

UPRIGHT_RAD = 0.1


class FastTwin:
    """An FR3 that is simulated as fast as the machine can; nothing can be lost on the way to it."""

    def __init__(self, world: World) -> None:
        self.limits: Limits = limits(world.task)
        self.clock: World = world
        self._world, self._gate = world, Gate(self.limits)
        self._holds = True

    def connect(self, timeout_s: float) -> Info:
        """Hold where it is; there is nothing to wait for.

        Raises:
            RobotError: the hand does not point down, so commands would not mean what they say.
        """
        check = self._upright()
        if not check.passed:
            raise RobotError(f"{check.name}: no, {check.found}; {check.cure}")
        self._gate.open()
        self._stay()
        return Info("fast twin", "twin", {"mujoco": version("mujoco")}, (check,))

    def observe(self) -> Snapshot:
        """The state now."""
        return self._world.snapshot(self._gate.epoch)

    def command(self, command: Command) -> Ack:
        """Move the target there, unless the gate refuses it."""
        return self._gate.apply(command, self._world.physics.position, self._send)

    def hold(self) -> None:
        """The target becomes the measured position and stays there; no effect after a stop."""
        if not self._holds and not self._gate.closed:
            self._stay()

    def stop(self, reason: str) -> None:
        """Hold and refuse whatever comes."""
        self.hold()
        self._gate.close()

    def recover(self, timeout_s: float) -> Recovery:
        """There are no reflexes here: a new epoch, and it holds."""
        if self._gate.closed:
            return Recovery(False, True, "the robot was stopped; connect first")
        self._gate.advance()
        self._stay()
        return Recovery(True, False, "there was nothing to clear")

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """Up, across and down to a start position, in simulated time.

        Raises:
            RobotError: it was stopped, or it did not get there in time.
        """
        if self._gate.closed:
            raise RobotError("the robot is stopped; connect first")
        self._gate.advance()
        self._grip(grip)
        physics, clock = self._world.physics, self.clock
        way = Way(physics.position, np.array(position), self.limits.step_m)
        until_s = clock.now_s() + timeout_s
        while (target := way.target(physics.position)) is not None:
            if self._gate.closed:
                raise RobotError("the robot is stopped; connect first")
            if clock.now_s() > until_s:
                self._stay()
                raise RobotError(f"the arm is not at its start after {timeout_s:g} s; see what blocks it")
            physics.aim(target)
            clock.sleep_until(clock.now_s() + 1.0 / self.limits.rate_hz)
        self._gate.advance()
        self._stay()

    def close(self) -> None:
        """Stop."""
        self.stop("closed")

    def _send(self, command: Command) -> None:
        with self._world.lock:
            self._world.physics.aim(np.array(command.position, np.float64))
            self._grip(command.grip)
        self._holds = False

    def _grip(self, grip: Grip) -> None:
        if grip != "keep":
            self._world.physics.grip = grip

    def _stay(self) -> None:
        with self._world.lock:
            self._world.physics.stay()
        self._holds = True

    def _upright(self) -> Check:
        physics = self._world.physics
        down = -float(physics.data.site_xmat[physics.at.tcp].reshape(3, 3)[2, 2])
        tilt_rad = float(np.arccos(min(max(down, -1.0), 1.0)))
        found = f"tilted by {tilt_rad:.3f} rad"
        return Check("the hand points down", tilt_rad < UPRIGHT_RAD, found, "lay out a start state")
