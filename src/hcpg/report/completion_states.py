"""Pictures of trials in their last moment, side by side, as in the paper's figure of completion states.

Each is drawn from the trial's log: the arm by its joint angles, the things by where they were seen.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.paper_tables import method_name, task_name
from hcpg.report.records import RecordError
from hcpg.report.styles import PAGE_IN, blank
from hcpg.report.trial_replay import LoggedTrial
from hcpg.twin.drawing import CAMERA, Drawing
from hcpg.twin.posing import Posing
from hcpg.twin.scenes import SCENES
from hcpg.types import UInt8

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIXELS = 720
VIEW_DEG = 27.0
"""Narrower than the scene's own camera: the hand and what it works on fill the picture."""
AIM_M = 0.02
"""The middle of the picture is so far below the TCP."""
STATES = {
    "peg-insertion": "the peg is inserted",
    "button-press": "the button is depressed",
    "drawer-closing": "the drawer is closed",
    "rugby-grasp": "the ball is held above the table",
}


def last_moment(trial: LoggedTrial) -> UInt8[np.ndarray, "H W 3"]:
    """The trial's last tick as a picture; works without a display.

    Raises:
        RecordError: the arm of the trial cannot be drawn.
        DrawingError: a library for OpenGL is missing.
    """
    name, tick = trial.facts["task"].rpartition("/")[2], trial.ticks[-1]
    if name not in SCENES or tick.joint_angles.size != 7:
        raise RecordError(f"{trial.title} cannot be drawn; tasks with a scene are {', '.join(SCENES)}")
    posing = Posing(name)
    camera = posing.model.camera(CAMERA)
    camera.fovy[0] = VIEW_DEG
    posing.pose(tick.joint_angles, tick.width_m, tick.sights)
    camera.pos[:] = _aimed(posing.data.cam_xmat[camera.id], camera.pos, tick.position)
    posing.pose(tick.joint_angles, tick.width_m, tick.sights)
    drawing = Drawing(posing.model, PIXELS)
    try:
        return drawing.picture(posing.data)
    finally:
        drawing.close()


def completion_figure(trials: Sequence[LoggedTrial]) -> "Figure":
    """One panel per trial, lettered.

    Raises:
        RecordError: a trial did not succeed, or cannot be drawn.
    """
    for trial in trials:
        if not trial.ticks[-1].success:
            raise RecordError(f"{trial.title} did not end with the task done; choose one that did")
    pictures = [last_moment(trial) for trial in trials]
    width_in = PAGE_IN / max(len(trials), 4)
    figure = blank(width_in * len(trials), width_in + 0.25)
    for place, (trial, picture) in enumerate(zip(trials, pictures, strict=True)):
        axes = figure.add_subplot(1, len(trials), place + 1)
        axes.imshow(picture, interpolation="antialiased")
        axes.set_axis_off()
        axes.set_title(f"({chr(ord('a') + place)}) {task_name(trial.facts['task'])}")
    return figure


def caption(trials: Sequence[LoggedTrial]) -> str:
    """What each panel shows, and that a twin is none of an arm."""
    parts = []
    for place, trial in enumerate(trials):
        facts, ticks = trial.facts, sum(tick.executed is not None for tick in trial.ticks)
        state = STATES[facts["task"].rpartition("/")[2]]
        who = f"{method_name(facts['policy'])}, start state {facts['start']}, {ticks} actions"
        parts.append(f"({chr(ord('a') + place)}) {state} ({who})")
    kinds = sorted({trial.facts["kind"] for trial in trials})
    arm = (
        "the twin, drawn from its log; no arm moved" if kinds == ["twin"] else f"{' and '.join(kinds)}, drawn"
    )
    return f"Completion states ({arm}): {'; '.join(parts)}."


def _aimed(axes: np.ndarray, position: np.ndarray, tcp: np.ndarray) -> np.ndarray:
    """The camera moved sideways, in its own picture's plane, until it looks just below the TCP."""
    frame = axes.reshape(3, 3)
    wanted = tcp - np.array([0.0, 0.0, AIM_M])
    across, up = frame[:, 0], frame[:, 1]
    way = wanted - position
    return position + (way @ across) * across + (way @ up) * up
