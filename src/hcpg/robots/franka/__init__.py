"""A Franka Research 3 with its hand, driven through the Franka Control Interface by franky."""

import importlib.util
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from hcpg.interfaces import Rig
from hcpg.perception.calibrated import Calibrated
from hcpg.robot_types import Kind, Limits, RobotError
from hcpg.robots.franka.driver import FrankaArm
from hcpg.robots.franka.setup import ARM

LIMITS = Limits(box_low_m=(0.28, -0.22, 0.022), box_high_m=(0.66, 0.22, 0.40))
"""Fingers that point down end 8 mm below the TCP: in this box they stay 14 mm above a table at z = 0."""
LOWEST_M = {"franka/peg-insertion": 0.088, "franka/button-press": 0.040}
"""Lower side of the box, by task: no lower than the task's goal needs."""
TOUCHED_OFF: Mapping[str, tuple[str, ...]] = {
    "franka/peg-insertion": ("hole",),
    "franka/button-press": ("button",),
}
"""What the positions file has to hold, by task."""
MOVING = ("franka/drawer-closing", "franka/rugby-grasp")
POSITIONS = Path("calibration/positions.json")
"""Touched-off positions, in the folder that the program runs in."""


class Person:
    """Whoever stands beside the arm lays the scene out."""

    def arrange(self, start: int) -> None:
        """Ask for start state `start`, and wait until it is there."""
        input(f"Lay out start state {start}, step back, then press Enter: ")

    def close(self) -> None:
        """Nothing to let go of."""


class FrankaRobot:
    """The plug-in; what moves is real."""

    kind: Kind = "real"

    def make(self, task: str, address: str | None) -> Rig:
        """A rig of the arm at `address`, with positions that were touched off.

        Raises:
            RobotError: there is no address or no driver, or the task needs more than is here.
        """
        if address is None:
            raise RobotError("a Franka has an address; give it, e.g. --address 172.16.0.2")
        if address == "localhost" or address.startswith("127."):
            raise RobotError(f"{address} is this machine, so what answers is a twin; use --robot twin")
        if not has_driver():
            raise RobotError("the driver is missing; install it: pip install 'hcpg-flow[franka]'")
        eyes = Calibrated.read(POSITIONS, _objects(task))
        return Rig(FrankaArm(address, task_limits(task), ARM), eyes, Person())


ROBOT = FrankaRobot()


def has_driver() -> bool:
    """Whether franky is installed."""
    return importlib.util.find_spec("franky") is not None


def _objects(task: str) -> tuple[str, ...]:
    if task in MOVING:
        cure = "make a Rig with a Perception that finds it, such as perception.apriltag"
        raise RobotError(f"the object of {task} moves, and this rig has no camera; {cure}")
    if task not in TOUCHED_OFF:
        raise RobotError(f"the Franka cannot do {task!r}; it can do {', '.join(TOUCHED_OFF)}")
    return TOUCHED_OFF[task]


def task_limits(task: str) -> Limits:
    """What the arm may do in a task."""
    return replace(LIMITS, box_low_m=(*LIMITS.box_low_m[:2], LOWEST_M.get(task, LIMITS.box_low_m[2])))
