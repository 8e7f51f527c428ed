"""A scene in this process: its time passes when it is waited for."""

import threading

import numpy as np

from hcpg.robot_types import Snapshot
from hcpg.twin.judging import Judge, Truth
from hcpg.twin.physics import STEPS_PER_TICK, TIMESTEP_S, Physics
from hcpg.twin.scenes import Layout, layout, scene
from hcpg.types import Float

CLEAR_M = 0.03
"""The arm is clear of the things when it is no more than this below its home."""
_SAME_STEP = 1e-6


class World:
    """One task's scene with its clock, its stage and its judge. It is a `Clock` and a `Stage`."""

    def __init__(self, task: str, seed: int) -> None:
        """Start states are the set that `seed` names; the scene begins laid out as start state 0."""
        self.task, self.scene, self._seed = task, scene(task), seed
        self.physics = Physics(self.scene)
        self.judge = Judge(task, self.physics.model, self.physics.data)
        self.lock = threading.RLock()
        self._pending: Layout | None = None
        self._layout = layout(self.scene, seed, 0)
        self.place(0)

    def place(self, start: int) -> None:
        """Lay out start state `start`, the arm too; time begins anew. So begins an episode of training."""
        with self.lock:
            self.physics.steps = 0
            self._pending, self._layout = None, layout(self.scene, self._seed, start)
            self.physics.lay_out(self._layout)
            self.judge.restart()

    def arrange(self, start: int) -> None:
        """Lay out start state `start` around the arm: at once, or as soon as the arm is clear of it."""
        with self.lock:
            self._pending = layout(self.scene, self._seed, start)
            self._arrange_when_clear()

    def now_s(self) -> float:
        """Simulated seconds since the last `place`."""
        return self.physics.steps * TIMESTEP_S

    def sleep_until(self, time_s: float) -> None:
        """Run the physics until then."""
        with self.lock:
            while self.physics.steps + _SAME_STEP < time_s / TIMESTEP_S:
                self.step()

    def step(self) -> None:
        """One time step; every sixteenth is a tick, at which the judge looks."""
        with self.lock:
            self.physics.step()
            if self.physics.steps % STEPS_PER_TICK == 0:
                self._arrange_when_clear()
                self.judge.tick()

    def snapshot(self, epoch: int, begun_s: float = 0.0) -> Snapshot:
        """What the arm reports; `begun_s` is the time at the last `place`."""
        with self.lock:
            physics, time_s = self.physics, begun_s + self.now_s()
            return Snapshot(
                sequence=physics.steps, epoch=epoch, robot_time_s=time_s, host_time_s=time_s,
                position=physics.position, velocity=physics.velocity, quaternion=physics.quaternion,
                joint_angles=physics.joint_angles, force=None, gripper_width_m=physics.width_m,
                gripper_time_s=time_s, gripper_refusals=0, mode="move", success_rate=1.0,
            )  # fmt: skip

    def truth(self) -> Truth:
        """What is true now."""
        with self.lock:
            return self.judge.look()

    def surveyed(self) -> dict[str, Float[np.ndarray, " 3"]]:
        """Where the thing that does not move was touched off, by its name; empty where none is needed."""
        if not self.scene.fixed:
            return {}
        with self.lock:
            truth = self.judge.look()
            place = truth.goal if self.scene.moving else self.judge.first
            return {self.scene.fixed: place + self._layout.survey}

    def moving(self) -> dict[str, Float[np.ndarray, " 3"]]:
        """Where the thing that a camera follows is now, by its name; empty where nothing moves."""
        return {self.scene.moving: self.truth().object} if self.scene.moving else {}

    def _arrange_when_clear(self) -> None:
        if self._pending is not None and clear(self.physics.position, self.scene.home):
            self._layout, self._pending = self._pending, None
            self.physics.arrange(self._layout)
            self.judge.restart()


def clear(position: Float[np.ndarray, " 3"], home: tuple[float, float, float]) -> bool:
    """Whether a TCP position is high enough for things to be laid out under it."""
    return bool(position[2] > home[2] - CLEAR_M)
