"""Tasks of Meta-World: what its 39 observed numbers mean, and the pieces that its adapters are made of.

Adapters take one observation or a batch, from NumPy, JAX (also under `jit`) or PyTorch, and read nothing
else. World axes: x to the robot's right, y away from it, z up.
"""

from hcpg.selection.geometry import moved
from hcpg.types import Float, Scene, Tensor

HORIZON = 500
CONTROL = (
    "one unit moves the hand's target 0.01 m along a world axis; "
    "the fourth entry is the fingers' effort: above 0 closes, below 0 opens"
)

HAND = slice(0, 3)
"""Position of the hand, well above the fingertips."""
OPENING = 3
"""Gap between the fingers: 1 open, 0.27 closed on nothing."""
OBJECT = slice(4, 7)
QUATERNION = slice(7, 11)
"""Of the object; scalar first in button-press and drawer-open, last in the other four tasks of the paper."""
SECOND_OBJECT = slice(11, 14)
SECOND_QUATERNION = slice(14, 18)
"""Zeros, like its position, where a task has one object."""
PREVIOUS = slice(18, 36)
"""The 18 numbers above, one step earlier."""
GOAL = slice(36, 39)

TIP_BELOW_HAND_M = 0.045


def read_paper_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """Hand, object and goal as observed; no contact flag is observed, so a distance gate decides.

    Source: paper, equation (4).
    """
    return Scene.of(observation[..., HAND], observation[..., OBJECT], observation[..., GOAL])


def tip(observation: Float[Tensor, "*batch O"]) -> Float[Tensor, "*batch 3"]:
    """The point between the fingertips."""
    return moved(observation[..., HAND], z=-TIP_BELOW_HAND_M)
