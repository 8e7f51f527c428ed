"""Lift a lever, from below, until it stands upright."""

from hcpg.interfaces import Task
from hcpg.selection.arrays import length, namespace
from hcpg.selection.geometry import flag, funnel, moved
from hcpg.tasks.metaworld import CONTROL, GOAL, HAND, HORIZON, OBJECT, read_paper_scene
from hcpg.types import Float, Scene, Tensor

SHOULDER_Y_M, SHOULDER_Z_M = 0.055, 0.07
"""From the hand to the part of it that lifts the lever; the offset in the task's own reward."""
LEVER_M = 0.2
FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M = 0.02, -0.1
CONTACT_M = 0.06


def lever_tangent(
    lever: Float[Tensor, "*batch 3"], goal: Float[Tensor, "*batch 3"]
) -> Float[Tensor, "*batch 3"]:
    """The direction in which the lever's tip turns upwards about its pivot, which lies below the goal."""
    arm = lever - moved(goal, z=-LEVER_M)
    return namespace(arm).stack([0.0 * arm[..., 0], arm[..., 2], -arm[..., 1]], axis=-1)


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand's shoulder goes under the lever's tip, then follows its arc."""
    lever, goal = observation[..., OBJECT], observation[..., GOAL]
    shoulder = moved(observation[..., HAND], y=SHOULDER_Y_M, z=SHOULDER_Z_M)
    approach = funnel(shoulder, lever, FUNNEL_RADIUS_M, FUNNEL_HEIGHT_M) - shoulder
    contact = flag(length(lever - shoulder) < CONTACT_M, observation)
    return Scene(shoulder, lever, goal, approach, lever_tangent(lever, goal), contact)


TASK = Task(
    suite="metaworld",
    env_id="lever-pull-v3",
    horizon=HORIZON,
    control=CONTROL,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)
