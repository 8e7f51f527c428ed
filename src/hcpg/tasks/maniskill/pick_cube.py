"""Grasp a cube and hold it still at a point above the table."""

from hcpg.interfaces import Task
from hcpg.tasks.maniskill import HORIZON, TRANSLATION
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


TASK = Task(
    suite="maniskill",
    env_id="PickCube-v1",
    horizon=HORIZON,
    control=TRANSLATION,
    adapters={"paper": read_scene, "contact": read_scene},
)
