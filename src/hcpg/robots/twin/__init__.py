"""The digital twin of a Franka arm: in this process, or served at a loopback address to the real driver."""

import importlib
import ipaddress
from typing import Any

from hcpg.interfaces import Rig
from hcpg.robot_types import Kind, RobotError
from hcpg.robots.twin.eyes import TwinEyes
from hcpg.robots.twin.fast import FastTwin
from hcpg.twin.channel import Listener
from hcpg.twin.limits import limits
from hcpg.twin.scenes import SCENES, scene
from hcpg.twin.world import World

START_SEED = 1_000_000
"""Names the start states of trials; those of training and evaluation have smaller seeds."""
NOISE_SEED = 7


class TwinRobot:
    """The plug-in; what moves is never real."""

    kind: Kind = "twin"

    def make(self, task: str, address: str | None) -> Rig:
        """The fast twin where `address` is None, else the driver of the arm at a served twin's address.

        Raises:
            RobotError: the twin has no such task, or the address is not this machine's own.
        """
        name = _known(task)
        if address is None:
            world = World(name, START_SEED)
            return Rig(FastTwin(world), TwinEyes(world, world.scene, NOISE_SEED), world)
        if not _is_own(address):
            raise RobotError(f"{address} is no loopback address, so no twin is there; an arm is `franka`")
        # Plug-ins do not import each other: the driver is asked for by name, as the registry does it.
        driver: Any = importlib.import_module("hcpg.robots.franka.driver")
        setup: Any = importlib.import_module("hcpg.robots.franka.setup").SERVED_TWIN
        listener = Listener(address)
        arm = driver.FrankaArm(address, limits(name), setup)
        return Rig(arm, TwinEyes(listener, scene(name), NOISE_SEED), listener)


ROBOT = TwinRobot()


def _known(task: str) -> str:
    suite, _, name = task.partition("/")
    if suite != "franka" or name not in SCENES:
        known = ", ".join(f"franka/{each}" for each in SCENES)
        raise RobotError(f"the twin cannot do {task!r}; it can do {known}")
    return name


def _is_own(address: str) -> bool:
    return address == "localhost" or (address[:4] == "127." and ipaddress.ip_address(address).is_loopback)
