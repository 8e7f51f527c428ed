"""Grasp a cube and hold it still at a point above the table."""

from dataclasses import replace

from hcpg.interfaces import Task
from hcpg.selection.geometry import moved
from hcpg.tasks.maniskill import HORIZON, POSE, TRANSLATION
from hcpg.types import Float, Scene, Tensor

IS_GRASPED = 18
"""Whether both fingers press on the cube; ManiSkill's own is wrong after a reset, the suite's is not."""
TOOL, GOAL, CUBE = slice(19, 22), slice(26, 29), slice(29, 32)


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Tool, cube and goal as observed; contact is the observed flag "grasped".

    Source: paper, equation (4).
    """
    return Scene.of(
        observation[..., TOOL], observation[..., CUBE], observation[..., GOAL], observation[..., IS_GRASPED]
    )


def read_lift_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The same, but once grasped the cube goes straight up, wherever its goal is.

    Source: paper, equation (4), with the lift adapter's task direction.
    """
    scene = read_scene(observation)
    return scene._replace(task=moved(0.0 * scene.tool, z=1.0))


TASK = Task(
    suite="maniskill",
    env_id="PickCube-v1",
    horizon=HORIZON,
    control=TRANSLATION,
    adapters={"paper": read_scene, "contact": read_scene},
)

VARIANTS = {
    "pick-cube-delta-pose": replace(TASK, control=POSE),
    "pick-cube-lift": replace(TASK, adapters={"paper": read_lift_scene, "contact": read_lift_scene}),
}
