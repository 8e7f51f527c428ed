"""Grasp a peg and insert it sideways into a hole."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag, moved, rotated
from hcpg.tasks.metaworld import CONTROL, GOAL, HORIZON, OBJECT, OPENING, QUATERNION, read_paper_scene, tip
from hcpg.types import Float, Scene, Tensor

HEAD_FROM_GRASP_M = (-0.13, 0.0, -0.01)
"""From where the peg is grasped to its head, in the peg's frame."""
CONTACT_M = 0.035
SMALLEST_GRASP, WIDEST_GRASP = 0.2, 0.75
"""Openings of fingers that hold the peg."""
STANDOFF_M = 0.1
ALIGNED_M = 0.02


def peg_head(observation: Float[Tensor, "*batch O"]) -> Float[Tensor, "*batch 3"]:
    """The end of the peg that goes into the hole."""
    return observation[..., OBJECT] + rotated(observation[..., QUATERNION], HEAD_FROM_GRASP_M)


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The fingertips grasp the peg; its head goes in front of the hole, and in once it is aligned."""
    tool, peg, goal = tip(observation), observation[..., OBJECT], observation[..., GOAL]
    opening, head = observation[..., OPENING], peg_head(observation)
    closed = (opening > SMALLEST_GRASP) & (opening < WIDEST_GRASP)
    contact = flag((length(peg - tool) < CONTACT_M) & closed, observation)
    ahead = goal - head
    astray = flag(length(moved(ahead, x=-ahead[..., 0])) > ALIGNED_M, observation)
    return Scene(tool, head, goal, peg - tool, moved(goal, x=STANDOFF_M * astray) - head, contact)


TASK = Task(
    suite="metaworld",
    env_id="peg-insert-side-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
