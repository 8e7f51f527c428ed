"""Grasp the object and carry it to the goal: HCPG over random proposals cannot, a learned policy can."""

from hcpg.interfaces import Task
from hcpg.types import Float, Scene, Tensor


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Tool, object and goal as observed; contact is the observed flag "held"."""
    return Scene.of(
        observation[..., 0:3], observation[..., 4:7], observation[..., 7:10], observation[..., 10]
    )


TASK = Task(
    suite="point",
    env_id="carry",
    horizon=60,
    control="one unit moves the tool 0.02 m along an axis; above 0.5 the fourth entry closes the fingers",
    adapters={"paper": read_scene, "contact": read_scene},
)
