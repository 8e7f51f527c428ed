"""Pull a cube over the table, towards the robot, into a disc."""

from dataclasses import replace

from hcpg.interfaces import Task
from hcpg.tasks.maniskill import HORIZON, POSE, TRANSLATION, read_contact_at_side
from hcpg.types import Float, Scene, Tensor

TOOL, GOAL, CUBE = slice(18, 21), slice(25, 28), slice(28, 31)
FAR_SIDE = 1.0


def read_paper_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Tool, cube and goal as observed; no contact flag is observed, so a distance gate decides.

    Source: paper, equation (4).
    """
    return Scene.of(observation[..., TOOL], observation[..., CUBE], observation[..., GOAL])


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand goes to the cube's face away from the robot, then pulls along the table."""
    return read_contact_at_side(
        observation[..., TOOL], observation[..., CUBE], observation[..., GOAL], FAR_SIDE
    )


TASK = Task(
    suite="maniskill",
    env_id="PullCube-v1",
    horizon=HORIZON,
    control=TRANSLATION,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)

VARIANTS = {"pull-cube-delta-pose": replace(TASK, control=POSE)}
