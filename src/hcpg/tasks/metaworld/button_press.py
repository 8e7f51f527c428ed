"""Push a button into its box, away from the robot."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag
from hcpg.tasks.metaworld import CONTROL, GOAL, HORIZON, OBJECT, read_paper_scene, tip
from hcpg.types import Float, Scene, Tensor

CONTACT_M = 0.08


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The fingertips push the button; within 8 cm of it, they push towards the goal."""
    tool, button, goal = tip(observation), observation[..., OBJECT], observation[..., GOAL]
    return Scene.of(tool, button, goal, flag(length(button - tool) < CONTACT_M, observation))


TASK = Task(
    suite="metaworld",
    env_id="button-press-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
