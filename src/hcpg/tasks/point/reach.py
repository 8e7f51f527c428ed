"""Bring the tool to the object: solved by any selector that reads the scene."""

from hcpg.interfaces import Task
from hcpg.types import Float, Scene, Tensor


def read_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Tool and object as observed; there is no contact to wait for, so the approach is all that counts."""
    held = observation[..., 10]
    return Scene.of(observation[..., 0:3], observation[..., 4:7], observation[..., 4:7], held * 0.0)


TASK = Task(
    suite="point",
    env_id="reach",
    horizon=60,
    control="one unit moves the tool 0.02 m along an axis; above 0.5 the fourth entry closes the fingers",
    adapters={"paper": read_scene, "contact": read_scene},
)
