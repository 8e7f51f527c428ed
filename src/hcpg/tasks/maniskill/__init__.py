"""Tasks of ManiSkill: the pieces that their adapters share.

Adapters take one observation or a batch, from NumPy, JAX (also under `jit`) or PyTorch, and read nothing
else. World axes: x away from the robot, y to its left, z up from the table; m. Where an observation holds
what, each task's file says; ManiSkill's quaternions have their scalar first.
"""

from hcpg.selection.arrays import length, namespace
from hcpg.selection.geometry import flag, flat, moved
from hcpg.types import Float, Scene, Tensor

HORIZON = 50
_UNIT = (
    "one unit commands 0.1 m along a world axis, of which 0.02 to 0.04 m come about in a step; "
    "the last entry is the gripper's: 1 opens, -1 closes"
)
TRANSLATION = f"pd_ee_delta_pos: {_UNIT}"
"""Four entries: the hand keeps its orientation."""
POSE = f"pd_ee_delta_pose: {_UNIT}; entries 3 to 5 turn the hand, by 0.1 rad a unit"
"""Seven entries."""
OPEN, CLOSE = 1.0, -1.0
"""The gripper's command: the opposite of Meta-World's."""

FINGERS = slice(7, 9)
"""How far each finger is open, 0 to 0.04 m."""
HALF_CUBE_M = 0.02
BEHIND_M = 0.025
"""From a face of the cube to where the fingers' middle stands to move it."""
CONTACT_M, LEVEL_M = 0.08, 0.03
"""Contact: the fingers' middle is this near to the cube's, and this level with it."""


def read_contact_at_side(
    tool: Float[Tensor, "*batch 3"],
    cube: Float[Tensor, "*batch 3"],
    goal: Float[Tensor, "*batch 3"],
    side: float,
) -> Scene:
    """The hand goes to the cube's far side (`side` 1) or near side (-1), then takes it along the table.

    Contact is where the hand is on that side of the cube, level with it, and near.
    """
    absolute = namespace(tool).abs(tool - cube)
    behind = side * (tool - cube)[..., 0] > 0.0
    level = (absolute[..., 1] < LEVEL_M) & (absolute[..., 2] < LEVEL_M)
    contact = flag(behind & level & (length(tool - cube) < CONTACT_M), tool)
    approach = moved(cube, x=side * (HALF_CUBE_M + BEHIND_M)) - tool
    return Scene(tool, cube, goal, approach, flat(goal - cube), contact)
