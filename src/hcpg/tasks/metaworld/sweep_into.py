"""Sweep a cube over the table into a hole."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag, flat
from hcpg.tasks.metaworld import CONTROL, GOAL, HORIZON, OBJECT, read_paper_scene, tip
from hcpg.types import Float, Scene, Tensor

CONTACT_M = 0.04


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The fingertips take the cube along the table; the goal's height, below the table, is left out."""
    tool, cube, goal = tip(observation), observation[..., OBJECT], observation[..., GOAL]
    contact = flag(length(cube - tool) < CONTACT_M, observation)
    return Scene(tool, cube, goal, cube - tool, flat(goal - cube), contact)


TASK = Task(
    suite="metaworld",
    env_id="sweep-into-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
