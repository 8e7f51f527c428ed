"""The nouns every other module speaks: scenes, transitions, sizes.

SI units throughout (metres, seconds, radians). Positions and directions are expressed in the frame of
the action's translation. Actions lie in [-1, 1]. Axis letters in annotations: R runs, E environments,
B batch, K candidates, N critics, O observation, A action, M flow steps, T time.
"""

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING or find_spec("jaxtyping") is not None:
    from jaxtyping import Bool, Float, Int, UInt8
else:
    # A robot computer has NumPy alone: there, shape annotations say nothing and cost nothing.
    class _Unchecked:
        def __class_getitem__(cls, _shape: object) -> object:
            return Any

    Bool = Float = Int = UInt8 = _Unchecked

Tensor = Any
"""A NumPy, JAX or PyTorch array; the code that takes one calls only what all three have."""


class Scene(NamedTuple):
    """The geometry a selector may see, read from one observation (or a batch of them).

    Source: paper, equations (3) and (4).
    """

    tool: Float[Tensor, "*batch 3"]
    """End-effector or tool point, m."""
    object: Float[Tensor, "*batch 3"]
    """Reference point of the manipulated object, m."""
    goal: Float[Tensor, "*batch 3"]
    """Where the object shall be, m."""
    approach: Float[Tensor, "*batch 3"]
    """Vector to close before contact, m; in the paper's reading `object - tool`."""
    task: Float[Tensor, "*batch 3"]
    """Vector to close after contact, m; in the paper's reading `goal - object`."""
    contact: Float[Tensor, "*batch"] | None
    """Grasp or contact flag in [0, 1]; None where the observation has none (a distance gate then)."""

    @classmethod
    def of(cls, tool: Tensor, object: Tensor, goal: Tensor, contact: Tensor | None = None) -> "Scene":
        """The paper's reading of three points: approach the object, then carry it to the goal.

        Source: paper, equation (4).
        """
        return cls(tool, object, goal, object - tool, goal - object, contact)


class Batch(NamedTuple):
    """Transitions as the learner sees them."""

    observations: Float[Tensor, "*batch O"]
    actions: Float[Tensor, "*batch A"]
    """What was executed: the blend, after clipping."""
    rewards: Float[Tensor, "*batch"]
    next_observations: Float[Tensor, "*batch O"]
    """The true last observation where an episode ended, never the next episode's first."""
    terminated: Float[Tensor, "*batch"]
    """1 where the task itself ended (no bootstrap), 0 otherwise, also at a time limit."""


class Sampling(NamedTuple):
    """How a method wants its batches drawn from the replay."""

    recent_share: float = 0.0
    """Part of the batch, in [0, 1], that comes from the newest transitions alone."""
    recent_window: int = 2048
    """How many of the newest transitions that part is drawn from."""


class Spec(NamedTuple):
    """Sizes that bind a method to a task."""

    observation_size: int
    action_size: int


class Step(NamedTuple):
    """What one environment answers to one action."""

    observation: Float[Tensor, " O"]
    reward: float
    terminated: bool
    success: bool
    """Whether the task's condition holds now."""


class RenderingError(RuntimeError):
    """No picture can be drawn on this machine; the message names what to install."""
