"""The scripted experts as policies of the control loop: they see a twin's truth and check the rest."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from hcpg.interfaces import Stage
from hcpg.loops.control.choosing import Propose
from hcpg.robot_types import RobotError
from hcpg.tasks.franka import OPENING, TCP, WIDEST_M, below_tcp
from hcpg.tasks.franka.button_press import FINGERTIP_M
from hcpg.tasks.franka.peg_insertion import PEG_TIP_M
from hcpg.twin.experts import Moment, act
from hcpg.twin.judging import TICKS, Truth
from hcpg.types import Float


@runtime_checkable
class Truthful(Protocol):
    """A stage that knows what is true on it: a twin's."""

    def truth(self) -> Truth:
        """What is true now."""
        ...


def referee_of(task: str, stage: Stage) -> Callable[[], bool] | None:
    """What says from the physics whether the task `suite/name` was done; None where nothing knows.

    A twin counts ticks of its own, which fall between those of the loop: where one tick is enough, what holds
    at the moment of the question is. And what a served twin tells is up to 50 ms old.
    """
    if not isinstance(stage, Truthful):
        return None
    at_once = TICKS.get(task.rpartition("/")[2]) == 1

    def done() -> bool:
        truth = stage.truth()
        return truth.was_done or (at_once and truth.holds)

    return done


def expert(task: str, stage: Stage, speed: float = 1.0) -> Propose:
    """The expert of the task `suite/name`, at a share of full speed in (0, 1].

    Raises:
        RobotError: the stage does not tell the truth, or no expert knows the task.
    """
    suite, _, name = task.partition("/")
    if suite != "franka" or not isinstance(stage, Truthful):
        raise RobotError(f"no expert for {task} here: it needs a task of the suite franka, on a twin")
    tip_m = PEG_TIP_M if name == "peg-insertion" else FINGERTIP_M

    def propose(observation: Float[np.ndarray, " O"], count: int, draw: int) -> Float[np.ndarray, "K A"]:
        truth, tool = stage.truth(), np.asarray(observation[TCP], np.float64)
        tip = np.asarray(below_tcp(observation, tip_m), np.float64)
        moment = Moment(tool, tip, truth.object, truth.goal, WIDEST_M * float(observation[OPENING]))
        return np.tile(act(name, moment, speed), (count, 1))

    return propose
