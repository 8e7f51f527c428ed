"""The four scenes: which files they are made of, and where things are laid out."""

import importlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.robot_types import Grip
from hcpg.types import Float

ASSETS = Path(__file__).parent / "assets"
PEG_WIDTH_M = 0.020
SURVEY_M = 0.0003
"""Standard deviation, along each axis, of a position that was touched off with the TCP."""
Point = tuple[float, float, float]


class Camera(NamedTuple):
    """How poorly a moving thing is seen; the fields of `perception.truth.Poorness`."""

    rate_hz: float = 10.0
    delay_s: float = 0.1
    noise_m: Point = (0.0001, 0.0001, 0.001)
    """Of a 40 mm tag from 0.6 m with refined corners."""
    dropouts: float = 0.02
    age_limit_s: float = 0.4


BALL_CAMERA = Camera(noise_m=(0.002, 0.002, 0.002), dropouts=0.05)
"""A ball carries no tag: the middle of a coloured patch in a depth picture."""


class Scene(NamedTuple):
    """One task's scene. Positions are in the arm's base frame, m; the table's top is z = 0."""

    file: str
    held: str
    """What the hand holds: a file of `assets`."""
    home: Point
    """TCP where an episode starts, before any variation."""
    home_grip: Grip
    fixture: Point
    """Nominal position of the body that a person would put there."""
    spread: Point
    """The fixture is laid out uniformly within this distance of its nominal position, along each axis."""
    fixed: str = ""
    """What was touched off before the episode and does not move (or where the drawer will be when closed)."""
    moving: str = ""
    """What a camera follows."""
    camera: Camera = Camera()
    finger_target_m: tuple[float, float] = (0.0, 0.04)
    """Of one finger, for a closed and for an open hand."""
    yaw_rad: float = 0.0
    """The fixture's largest turn about the vertical."""
    opening_m: tuple[float, float] = (0.0, 0.0)
    """Range of the drawer's opening at the start."""


SCENES = {
    "peg-insertion": Scene(
        file="peg_insertion.xml",
        held="peg.xml",
        home=(0.45, 0.0, 0.24),
        home_grip="close",
        fixture=(0.45, 0.0, 0.0),
        spread=(0.04, 0.05, 0.0),
        fixed="hole",
        finger_target_m=(PEG_WIDTH_M / 2, PEG_WIDTH_M / 2),
    ),
    "button-press": Scene(
        file="button_press.xml",
        held="empty.xml",
        home=(0.45, 0.0, 0.20),
        home_grip="close",
        fixture=(0.45, 0.0, 0.0),
        spread=(0.06, 0.06, 0.0),
        fixed="button",
    ),
    "drawer-closing": Scene(
        file="drawer_closing.xml",
        held="empty.xml",
        home=(0.36, 0.0, 0.12),
        home_grip="close",
        fixture=(0.62, 0.0, 0.0),
        spread=(0.02, 0.04, 0.0),
        fixed="cabinet",
        moving="drawer",
        opening_m=(0.10, 0.15),
    ),
    "rugby-grasp": Scene(
        file="rugby_grasp.xml",
        held="empty.xml",
        home=(0.45, 0.0, 0.20),
        home_grip="open",
        fixture=(0.45, 0.0, 0.032),
        spread=(0.06, 0.08, 0.0),
        moving="ball",
        camera=BALL_CAMERA,
        yaw_rad=0.17,
    ),
}
"""By task, as in `franka/<task>`."""


class Layout(NamedTuple):
    """One start state of a scene."""

    fixture: Float[np.ndarray, " 3"]
    yaw_rad: float
    opening_m: float
    start: Float[np.ndarray, " 3"]
    """TCP, m."""
    survey: Float[np.ndarray, " 3"]
    """Error of the touched-off position, m."""


START_SPREAD_M = 0.02
"""The TCP starts uniformly within this distance of home, along each axis."""


def scene(task: str) -> Scene:
    """The scene of a task, by the part of its name after the slash.

    Raises:
        ValueError: the twin has no such task.
    """
    if task not in SCENES:
        raise ValueError(f"the twin has no task {task!r}; it has {', '.join(SCENES)}")
    return SCENES[task]


def layout(of: Scene, seed: int, start: int) -> Layout:
    """Start state `start` of the set that `seed` names: a function of the two numbers."""
    random = np.random.default_rng([seed, start])
    fixture = np.array(of.fixture) + random.uniform(-1, 1, 3) * of.spread
    yaw_rad = of.yaw_rad * random.uniform(-1, 1)
    opening_m = random.uniform(*of.opening_m)
    begin = np.array(of.home) + START_SPREAD_M * random.uniform(-1, 1, 3)
    return Layout(fixture, yaw_rad, opening_m, begin, SURVEY_M * random.normal(size=3))


def build(of: Scene, timestep_s: float) -> Any:
    """The scene's compiled `MjModel`. Gravity is compensated for the robot's bodies alone."""
    mujoco: Any = importlib.import_module("mujoco")
    files = {path.name: path.read_bytes() for path in ASSETS.glob("*.stl")}
    files |= {name: (ASSETS / name).read_bytes() for name in ("fr3.xml", "table.xml")}
    files["held.xml"] = (ASSETS / of.held).read_bytes()
    model = mujoco.MjModel.from_xml_string((ASSETS / of.file).read_text(), files)
    model.opt.timestep = timestep_s
    return model
