"""The served twin: a scene behind the Franka Control Interface's own protocol, with its reflexes enforced.

Run with the twin's own environment (`make twin`): `python -m hcpg.twin.serving --task peg-insertion`. It
binds a loopback address only. Beside the protocol's two ports there is a third, where the truth is told and
scenes are laid out; a policy knows of it through a `Perception` alone.

The server is franka-sim's; the robot model and the table are ours. franka-sim reports the pose of the seventh
link where the protocol means the flange, 107 mm further on; that is set right here.
"""

import argparse
import importlib
import ipaddress
import logging
import os
import signal
from typing import Any

import numpy as np

from hcpg.twin.bench import Bench
from hcpg.twin.bodies import FLANGE_M, HOME_ANGLES, angles_for, arrange, finger_forces
from hcpg.twin.channel import Teller
from hcpg.twin.scenes import SCENES, build, scene
from hcpg.types import Float

_mujoco: Any = importlib.import_module("mujoco")
_backend: Any = importlib.import_module("franka_sim.mujoco_franka_sim")

TICK_S = 1.0 / 30.0
SETTLING_STEPS = 100
PRIORITY = 20
"""Of the server among real-time programs; franky's own loop has a higher one."""
LINK_FROM_FLANGE = np.block([[np.eye(3), np.array([[0.0], [0.0], [FLANGE_M]])], [np.zeros(3), np.ones(1)]])


class ServedPhysics(_backend.MujocoFrankaSim):
    """franka-sim's simulated arm, with our scene around it. The thread that steps it runs the table too."""

    def __init__(self, task: str, seed: int, host: str) -> None:
        """Nothing is built before `initialize_simulation`."""
        super().__init__(enable_hand=True)
        self._task, self._seed, self._scene = task, seed, scene(task)
        self._teller, self._ticket, self._next_tick_s = Teller(host), 0, 0.0
        self.prefix = "fr3_"
        self.update_ee_transform(np.eye(4).flatten())

    def initialize_simulation(self) -> None:
        """Build the scene, put the arm at the task's home and hold it there."""
        self.model = build(self._scene, self.dt)
        self.data = _mujoco.MjData(self.model)
        self._bind_model()
        self._configure_model()
        start = angles_for(self.model, np.array(self._scene.home), HOME_ANGLES)
        self.data.qpos[self.arm_qpos_adr] = start
        self.update_joint_positions(start)
        self._position_feedforward.reset(start)
        self.update_finger_positions(np.full(2, self._scene.finger_target_m[self._scene.home_grip == "open"]))
        self.data.qpos[self.finger_qpos_adr] = self.latest_finger_positions
        self._bench = Bench(self._task, self._seed, self.model, self.data)
        laid_out = self._bench.layout(0)
        arrange(self.model, self.data, laid_out)
        _mujoco.mj_forward(self.model, self.data)
        self._bench.begin(laid_out)
        for _ in range(SETTLING_STEPS):
            self._apply_control()
            _mujoco.mj_step(self.model, self.data)
        self._read_and_publish_state()

    def update_ee_transform(self, f_t_ee: Float[np.ndarray, " 16"]) -> None:
        """Take the end effector's frame, given from the flange, as one given from the seventh link."""
        given = np.asarray(f_t_ee, np.float64).reshape(4, 4).T
        super().update_ee_transform((LINK_FROM_FLANGE @ given).T.flatten())

    def finger_control_force(self) -> Float[np.ndarray, " 2"]:
        """The hand closes no further than onto what it holds."""
        narrowest = min(self._scene.finger_target_m)
        wanted = np.clip(self.latest_finger_positions, narrowest, _backend.MAX_FINGER_TRAVEL)
        places, speeds = self.data.qpos[self.finger_qpos_adr], self.data.qvel[self.finger_dofs_idx]
        return finger_forces(wanted, places, speeds)

    def _apply_control(self) -> None:
        super()._apply_control()
        if self.data.time >= self._next_tick_s:
            self._next_tick_s += TICK_S
            self._tick()

    def _tick(self) -> None:
        while not self._teller.requests.empty():
            request = self._teller.requests.get()
            if request.ticket != self._ticket:
                self._ticket = request.ticket
                self._bench.ask_for(request.start)
        if self._bench.tick():
            _mujoco.mj_forward(self.model, self.data)
            self._bench.begin_pending()
        self._teller.say(self._bench, self._ticket)


def serve(task: str, host: str, seed: int, realtime: bool) -> None:
    """Serve until the process is told to end.

    Raises:
        ValueError: the address is not this machine's own, or the twin has no such task.
        PermissionError: `realtime`, and this user may not ask for it.
    """
    if realtime:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    if not ipaddress.ip_address(host).is_loopback:
        raise ValueError(f"{host} is no loopback address; the twin serves this machine alone: 127.0.0.1")
    server_class: Any = importlib.import_module("franka_sim.franka_sim_server").FrankaSimServer
    physics = ServedPhysics(task, seed, host)
    enforced = {"enforce_comm_constraints": True, "enforce_motion_limits": True}
    server = server_class(host=host, physics_sim=physics, gripper_physics=True, **enforced)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: physics.stop())
    try:
        server.start()
    finally:
        server.stop()


def main() -> None:
    """Read the command line and serve."""
    parser = argparse.ArgumentParser(description="Serve the twin of one task.")
    parser.add_argument("--task", required=True, choices=list(SCENES))
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--realtime",
        action="store_true",
        help="before other programs, as a controller is; root may ask for it",
    )
    chosen = parser.parse_args()
    logging.basicConfig(level=logging.WARNING, format="%(asctime)s %(levelname)s %(name)s %(message)s")
    serve(chosen.task, chosen.host, chosen.seed, chosen.realtime)


if __name__ == "__main__":
    main()
