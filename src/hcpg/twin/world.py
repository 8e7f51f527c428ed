"""A scene in this process: its time passes when it is waited for."""

import threading

from hcpg.robot_types import Snapshot
from hcpg.twin.bench import Bench, Places
from hcpg.twin.judging import Truth
from hcpg.twin.physics import STEPS_PER_TICK, TIMESTEP_S, Physics
from hcpg.twin.scenes import scene

_SAME_STEP = 1e-6


class World:
    """One task's scene with its clock and its table: a `Clock` and a `Stage`. Any thread may call it."""

    def __init__(self, task: str, seed: int) -> None:
        """Start states are the set that `seed` names; the scene begins laid out as start state 0."""
        self.task, self.scene = task, scene(task)
        self.physics = Physics(self.scene)
        self._bench = Bench(task, seed, self.physics.model, self.physics.data)
        self.lock = threading.RLock()
        self.place(0)

    def place(self, start: int) -> None:
        """Lay out start state `start`, the arm too; time begins anew. So begins an episode of training."""
        with self.lock:
            self.physics.steps = 0
            laid_out = self._bench.layout(start)
            self.physics.lay_out(laid_out)
            self._bench.begin(laid_out)

    def arrange(self, start: int) -> None:
        """Lay out start state `start` around the arm, as soon as the arm is clear of the things."""
        with self.lock:
            self._bench.ask_for(start)
            self._tick()

    def close(self) -> None:
        """Nothing to let go of."""

    def now_s(self) -> float:
        """Simulated seconds since the last `place`."""
        return self.physics.steps * TIMESTEP_S

    def sleep_until(self, time_s: float) -> None:
        """Run the physics until then."""
        with self.lock:
            while self.physics.steps + _SAME_STEP < time_s / TIMESTEP_S:
                self.physics.step()
                if self.physics.steps % STEPS_PER_TICK == 0:
                    self._tick()

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
            return self._bench.truth()

    def surveyed(self) -> Places:
        """Where the thing that does not move was touched off, m, by its name; empty where none is needed."""
        with self.lock:
            return self._bench.surveyed()

    def moving(self) -> Places:
        """Where the thing that a camera follows is now, m, by its name; empty where nothing moves."""
        with self.lock:
            return self._bench.moving()

    def _tick(self) -> None:
        if self._bench.tick():
            self.physics.refresh()
            self._bench.begin_pending()
