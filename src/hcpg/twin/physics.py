"""One scene's physics in this process: the arm under impedance control, the hand, the things on the table."""

import importlib
from typing import Any

import numpy as np

from hcpg.robot_types import Grip
from hcpg.twin.bodies import HOME_ANGLES, Addresses, angles_for, arrange, finger_forces
from hcpg.twin.impedance import Gains, Impedance, Readings
from hcpg.twin.scenes import Layout, Scene, build
from hcpg.types import Float

STEPS_PER_TICK = 16
TICK_S = 1.0 / 30.0
TIMESTEP_S = TICK_S / STEPS_PER_TICK
"""About 2 ms: half the cost of the controller's own 1 ms, and a whole number of steps per tick."""

LATENCY_STEPS = 2
"""From the state that a command answers to its arrival, in steps: 4 ms, as over the served twin's driver."""


class Physics:
    """A scene that steps only when it is told to."""

    def __init__(self, scene: Scene, gains: Gains | None = None) -> None:
        self._mujoco: Any = importlib.import_module("mujoco")
        self.scene, self.model = scene, build(scene, TIMESTEP_S)
        self.data = self._mujoco.MjData(self.model)
        self.at = Addresses.of(self.model)
        self._jacobian = np.zeros((6, self.model.nv))
        start = angles_for(self.model, np.array(scene.home), HOME_ANGLES)
        self._impedance = Impedance(gains or Gains(), np.diag([1.0, -1.0, -1.0]), start)
        self.steps = 0
        self.target = np.array(scene.home)
        self._coming: tuple[int, Float[np.ndarray, " 3"]] | None = None
        self.grip: Grip = scene.home_grip

    def lay_out(self, layout: Layout) -> None:
        """Put the things and the arm where the layout says, at rest."""
        self._mujoco.mj_resetData(self.model, self.data)
        arrange(self.model, self.data, layout)
        self.data.qpos[self.at.arm] = angles_for(self.model, layout.start, HOME_ANGLES)
        self.grip = self.scene.home_grip
        self.data.qpos[self.at.fingers] = self._finger_target()
        self.refresh()
        self._impedance.relax()
        self.stay()

    def refresh(self) -> None:
        """Work out all positions anew, after something was put elsewhere."""
        self._mujoco.mj_forward(self.model, self.data)

    def aim(self, target: Float[np.ndarray, " 3"]) -> None:
        """Let the target be there, m, as soon as a command takes to arrive."""
        self._coming = (self.steps + LATENCY_STEPS, target)

    def stay(self) -> None:
        """Let the target be where the TCP is, at once."""
        self._coming, self.target = None, self.position

    def step(self) -> None:
        """One time step: forces from where everything is now, then motion."""
        data, at = self.data, self.at
        if self._coming is not None and self.steps >= self._coming[0]:
            self.target, self._coming = self._coming[1], None
        self._mujoco.mj_step1(self.model, data)
        data.qfrc_applied[at.arm_speeds] = self._impedance.torques(self._readings(), self.target, TIMESTEP_S)
        data.qfrc_applied[at.finger_speeds] = finger_forces(
            self._finger_target(), data.qpos[at.fingers], data.qvel[at.finger_speeds]
        )
        self._mujoco.mj_step2(self.model, data)
        self.steps += 1

    @property
    def position(self) -> Float[np.ndarray, " 3"]:
        """Of the TCP, m."""
        return self.data.site_xpos[self.at.tcp].copy()

    @property
    def velocity(self) -> Float[np.ndarray, " 3"]:
        """Of the TCP, m/s."""
        return self._read_jacobian()[:3] @ self.data.qvel[self.at.arm_speeds]

    @property
    def quaternion(self) -> Float[np.ndarray, " 4"]:
        """Of the hand, scalar last."""
        scalar_first = np.zeros(4)
        self._mujoco.mju_mat2Quat(scalar_first, self.data.site_xmat[self.at.tcp])
        return np.roll(scalar_first, -1)

    @property
    def joint_angles(self) -> Float[np.ndarray, " 7"]:
        """Of the arm, rad."""
        return self.data.qpos[self.at.arm].copy()

    @property
    def width_m(self) -> float:
        """Between the fingers."""
        return float(self.data.qpos[self.at.fingers].sum())

    def _finger_target(self) -> float:
        return self.scene.finger_target_m[self.grip == "open"]

    def _readings(self) -> Readings:
        data, at = self.data, self.at
        coriolis = (data.qfrc_bias - data.qfrc_gravcomp)[at.arm_speeds]
        rotation = data.site_xmat[at.tcp].reshape(3, 3)
        angles, speeds = data.qpos[at.arm], data.qvel[at.arm_speeds]
        return Readings(data.site_xpos[at.tcp], rotation, self._read_jacobian(), angles, speeds, coriolis)

    def _read_jacobian(self) -> Float[np.ndarray, "6 7"]:
        full = self._jacobian
        self._mujoco.mj_jacSite(self.model, self.data, full[:3], full[3:], self.at.tcp)
        return full[:, self.at.arm_speeds]
