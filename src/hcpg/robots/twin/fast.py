"""The fast twin's arm: the robot socket over a world whose time runs when it is waited for."""

from importlib.metadata import version

import numpy as np

from hcpg.robot_types import Ack, Check, Command, Grip, Info, Limits, Recovery, RobotError, Snapshot
from hcpg.safety.gate import Gate
from hcpg.twin.limits import limits
from hcpg.twin.world import World
from hcpg.types import Float, Tensor

RESET_SPEED_M_S = 0.15
ARRIVED_M = 0.004
UPRIGHT_RAD = 0.1
_TICK_S = 1.0 / 30.0


class FastTwin:
    """An FR3 that is simulated as fast as the machine can; nothing can be lost on the way to it."""

    def __init__(self, world: World) -> None:
        self.limits: Limits = limits(world.task)
        self.clock: World = world
        self._world, self._gate = world, Gate(self.limits)
        self._holds = False

    def connect(self, timeout_s: float) -> Info:
        """Hold where it is; there is nothing to wait for.

        Raises:
            RobotError: the hand does not point down, so commands would not mean what they say.
        """
        checks = (self._upright(),)
        failed = [check for check in checks if not check.passed]
        if failed:
            raise RobotError(f"{failed[0].name}: {failed[0].found}; {failed[0].cure}")
        self._gate.open()
        self._holds = False
        self.hold()
        return Info("fast twin", "twin", {"mujoco": version("mujoco")}, checks)

    def observe(self) -> Snapshot:
        """The state now."""
        return self._world.snapshot(self._gate.epoch)

    def command(self, command: Command) -> Ack:
        """Move the target there, unless the gate refuses it."""
        return self._gate.apply(command, self._world.physics.position, self._send)

    def hold(self) -> None:
        """The target becomes the measured position and stays there; no effect after a stop."""
        if not self._holds and not self._gate.closed:
            with self._world.lock:
                self._world.physics.target = self._world.physics.position
            self._holds = True

    def stop(self, reason: str) -> None:
        """Hold and refuse whatever comes."""
        self.hold()
        self._gate.close()

    def recover(self, timeout_s: float) -> Recovery:
        """There are no reflexes here: a new epoch, and it holds."""
        if self._gate.closed:
            return Recovery(False, True, "the robot was stopped; connect first")
        self._gate.advance()
        self._holds = False
        self.hold()
        return Recovery(True, False, "")

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """Straight up, across, and down to a start position.

        Raises:
            RobotError: it was stopped, or it is not there in time, simulated seconds.
        """
        if self._gate.closed:
            raise RobotError("the robot was stopped; connect first")
        self._gate.advance()
        until_s = self._world.now_s() + timeout_s
        goal = np.array(position, np.float64)
        self._grip(grip)
        for point in way(self._world.physics.position, goal):
            self._follow(point, until_s)
        away = float(np.linalg.norm(self._world.physics.position - goal))
        if away > ARRIVED_M:
            raise RobotError(
                f"the arm is {1000 * away:.0f} mm from its start after {timeout_s} s; see what blocks it"
            )
        self._gate.advance()
        self._holds = False
        self.hold()

    def close(self) -> None:
        """Stop."""
        self.stop("closed")

    def _send(self, command: Command) -> None:
        with self._world.lock:
            self._world.physics.target = np.array(command.position, np.float64)
            self._grip(command.grip)
        self._holds = False

    def _grip(self, grip: Grip) -> None:
        if grip != "keep":
            self._world.physics.grip = grip

    def _follow(self, goal: Float[np.ndarray, " 3"], until_s: float) -> None:
        """Lead the arm to `goal` with a target that moves slowly, and stays once it is there."""
        clock, physics = self._world, self._world.physics
        while np.linalg.norm(goal - physics.position) > ARRIVED_M / 2 and clock.now_s() < until_s:
            if self._gate.closed:
                raise RobotError("the robot was stopped on the way to its start")
            lead = goal - physics.position
            step = self.limits.step_m
            length = float(np.linalg.norm(lead))
            physics.target = goal if length < step else physics.position + lead * (step / length)
            clock.sleep_until(clock.now_s() + _TICK_S)

    def _upright(self) -> Check:
        physics = self._world.physics
        down = -physics.data.site_xmat[physics.at.tcp].reshape(3, 3)[2, 2]
        tilt_rad = float(np.arccos(np.clip(down, -1.0, 1.0)))
        cure = "lay out a start state"
        return Check("the hand points down", tilt_rad < UPRIGHT_RAD, f"tilted {tilt_rad:.3f} rad", cure)


def way(start: Float[Tensor, " 3"], goal: Float[np.ndarray, " 3"]) -> list[Float[np.ndarray, " 3"]]:
    """Straight up first, so that nothing is dragged along; then across; then to the goal."""
    height = max(float(start[2]), float(goal[2]))
    return [np.array([start[0], start[1], height]), np.array([goal[0], goal[1], height]), goal]
