"""Pull a door open by its handle, towards the robot and to its left."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import length
from hcpg.selection.geometry import flag, funnel, moved
from hcpg.tasks.metaworld import CONTROL, GOAL, HAND, HORIZON, OBJECT, read_paper_scene
from hcpg.types import Float, Scene, Tensor

BESIDE_HANDLE_M, BEHIND_HANDLE_M = 0.01, 0.02
FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M = 0.08, 0.10
CONTACT_M = 0.05


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand comes down behind the handle, then goes straight for the goal: the door's arc is wide."""
    hand, handle, goal = observation[..., HAND], observation[..., OBJECT], observation[..., GOAL]
    hook = moved(handle, x=BESIDE_HANDLE_M, y=BEHIND_HANDLE_M)
    approach = funnel(hand, hook, FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M) - hand
    contact = flag(length(hook - hand) < CONTACT_M, observation)
    return Scene(hand, handle, goal, approach, goal - handle, contact)


TASK = Task(
    suite="metaworld",
    env_id="door-open-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
