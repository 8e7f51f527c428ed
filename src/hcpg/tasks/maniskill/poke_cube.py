"""Grasp a peg and poke a cube with it, away from the robot, into a disc.

Two entries of the observation are not what their names say. Its `goal_pos` is the peg's position, so the goal
is read from the vector between cube and goal. Its `peghead_to_cube_pos` leads the other way, from a head that
does not turn with the peg, so the head is read from the peg's pose.
"""

from dataclasses import replace

from hcpg.interfaces import Task
from hcpg.selection.arrays import length, namespace
from hcpg.selection.geometry import flag, moved, rotated
from hcpg.tasks.maniskill import FINGERS, HORIZON, POSE, TRANSLATION
from hcpg.types import Float, Scene, Tensor

TOOL, CUBE, PEG, PEG_QUATERNION = slice(18, 21), slice(25, 28), slice(32, 35), slice(35, 39)
CUBE_TO_GOAL = slice(48, 51)
HEAD_FROM_PEG_M = (0.12, 0.0, 0.0)
"""From the middle of the peg to its head, in the peg's frame."""
HALF_PEG_WIDTH_M, FINGER_TOLERANCE_M, GRASP_M = 0.025, 0.003, 0.06
"""Fingers that hold the peg are this far open, give or take, and their middle is this near to the peg's."""
ALIGNED_M, STANDOFF_M = 0.012, 0.03
"""The head pushes once it is as near to the cube's line as this, or as near to the cube along it as that."""
HALF_CUBE_M = 0.02


def peg_head(observation: Float[Tensor, "*batch O"]) -> Float[Tensor, "*batch 3"]:
    """The end of the peg that pokes."""
    first, x, y, z = (observation[..., 35 + entry] for entry in range(4))
    scalar_last = namespace(observation).stack([x, y, z, first], axis=-1)
    return observation[..., PEG] + rotated(scalar_last, HEAD_FROM_PEG_M)


def goal_of(observation: Float[Tensor, "*batch O"]) -> Float[Tensor, "*batch 3"]:
    """Where the cube shall be."""
    return observation[..., CUBE] + observation[..., CUBE_TO_GOAL]


def read_paper_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The peg's head is the tool; no contact flag is observed, so a distance gate decides.

    Source: paper, equation (4).
    """
    return Scene.of(peg_head(observation), observation[..., CUBE], goal_of(observation))


def read_contact_scene(observation: Float[Tensor, "*batch O"]) -> Scene:
    """The hand grasps the peg; the peg's head goes in line with the cube, then pushes it to the goal.

    The tool is the hand, and the peg's head once the fingers hold the peg. A cube that was pushed too far is
    let be: a peg can push, and not pull.
    """
    tool, cube, peg = observation[..., TOOL], observation[..., CUBE], observation[..., PEG]
    head, goal, xp = peg_head(observation), goal_of(observation), namespace(observation)
    width = xp.abs(observation[..., FINGERS] - HALF_PEG_WIDTH_M)
    holds = (width[..., 0] < FINGER_TOLERANCE_M) & (width[..., 1] < FINGER_TOLERANCE_M)
    contact = flag(holds & (length(peg - tool) < GRASP_M), observation)
    aside = (cube - head)[..., 1]
    short = (cube - head)[..., 0] - HALF_CUBE_M > STANDOFF_M
    aligns = flag((xp.abs(aside) > ALIGNED_M) & short, observation)
    still = 0.0 * head
    ahead = xp.clip((goal - cube)[..., 0], 0.0, None)
    task = moved(still, x=(1.0 - aligns) * ahead, y=aligns * aside)
    point = xp.where(contact[..., None] > 0.5, head, tool)
    return Scene(point, cube, goal, peg - tool, task, contact)


TASK = Task(
    suite="maniskill",
    env_id="PokeCube-v1",
    horizon=HORIZON,
    control=POSE,
    adapters={"paper": read_paper_scene, "contact": read_contact_scene},
)

VARIANTS = {"poke-cube-delta-pos": replace(TASK, control=TRANSLATION)}
"""Held upright, the hand reaches little more than half of the pegs far enough."""
