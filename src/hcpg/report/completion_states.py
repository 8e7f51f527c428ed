"""Pictures of trials in their last moment, side by side, as in the paper's figure of completion states.

Each is drawn from the trial's log: the arm by its joint angles, the things by where they were seen.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hcpg.report.paper_tables import method_name, task_name
from hcpg.report.records import RecordError
from hcpg.report.styles import PAGE_IN, blank
from hcpg.report.trial_replay import LoggedTrial
from hcpg.twin.drawing import CAMERA, Drawing
from hcpg.twin.posing import Posing, quaternion_of
from hcpg.twin.scenes import SCENES
from hcpg.types import Float, UInt8

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIXELS = 720
VIEW_DEG = 24.0
AIM_M = 0.03
"""The middle of the picture is so far above the TCP."""
EYES_M = {"drawer-closing": (-0.55, -0.75, 0.45)}
"""From the middle of the picture to the camera: from the arm's side, where the drawer would hide the hand."""
EYE_M = (0.40, -0.85, 0.40)
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
    _look(posing.model, tick.position + np.array([0.0, 0.0, AIM_M]), np.array(EYES_M.get(name, EYE_M)))
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
    figure = blank(width_in * len(trials), width_in + 0.35)
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


def _look(model: Any, middle: Float[np.ndarray, " 3"], eye: Float[np.ndarray, " 3"]) -> None:
    """Turn the scene's camera to look at `middle` from `eye` beside it, level."""
    back = eye / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    frame = np.stack([right, np.cross(back, right), back], axis=1)
    camera = model.camera(CAMERA)
    camera.pos[:], camera.fovy[0] = middle + eye, VIEW_DEG
    camera.quat[:] = quaternion_of(frame)
