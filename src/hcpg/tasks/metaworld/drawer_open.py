"""Pull a drawer open by its handle, towards the robot."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import namespace
from hcpg.selection.geometry import flag, funnel, moved, planar_distance
from hcpg.tasks.metaworld import CONTROL, GOAL, HAND, HORIZON, OBJECT, read_paper_scene
from hcpg.types import Float, Scene, Tensor

BELOW_HANDLE_M = 0.02
FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M = 0.06, 0.28
CONTACT_HEIGHT_M = 0.04


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand comes down onto the handle, so that the fingers get behind it, then pulls."""
    hand, handle, goal = observation[..., HAND], observation[..., OBJECT], observation[..., GOAL]
    hook = moved(handle, z=-BELOW_HANDLE_M)
    approach = funnel(hand, hook, FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M) - hand
    above = planar_distance(hand, hook) < FUNNEL_RADIUS_M
    level = namespace(hand).abs((hook - hand)[..., 2]) < CONTACT_HEIGHT_M
    return Scene(hand, handle, goal, approach, goal - handle, flag(above & level, observation))


TASK = Task(
    suite="metaworld",
    env_id="drawer-open-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
