"""The sockets: what a method, a suite, an environment, a task and a robot must offer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

from hcpg.robot_types import Ack, Command, Grip, Info, Kind, Limits, Recovery, Sight, Snapshot
from hcpg.types import Batch, Bool, Float, Int, Sampling, Scene, Spec, Step, Tensor, UInt8

Metrics = Mapping[str, Tensor]
ReadScene = Callable[[Float[Tensor, "*batch O"]], Scene]


@runtime_checkable
class Method(Protocol):
    """A learner bound to its `config` and `spec`; every call is pure.

    It is hashable by both: programs compiled for it are kept.

    Its state is a NamedTuple that holds a field `updates`, the count of updates made. All runs of a
    population share that count, so it alone gets no run axis (and `lax.cond` on it stays a branch).
    """

    config: Any
    spec: Spec
    sampling: ClassVar[Sampling]
    """How its batches are drawn; `Sampling()` is uniform."""

    def init(self, key: Tensor) -> Any:
        """Everything that learning changes, fresh."""
        ...

    def propose(
        self, state: Any, observation: Float[Tensor, " O"], key: Tensor, count: int
    ) -> Float[Tensor, "K A"]:
        """`count` candidate actions in [-1, 1], independent in all their noise."""
        ...

    def act(self, state: Any, observation: Float[Tensor, " O"], key: Tensor) -> Float[Tensor, " A"]:
        """The method's own evaluation action, in [-1, 1]."""
        ...

    def update(self, state: Any, batch: Batch, key: Tensor) -> tuple[Any, Metrics]:
        """One learning step on a batch of B transitions; it never sees a selector."""
        ...


@runtime_checkable
class Valued(Protocol):
    """What a method with a critic offers too; selectors that rank by value need it."""

    def value(
        self, state: Any, observation: Float[Tensor, " O"], actions: Float[Tensor, "K A"]
    ) -> Float[Tensor, " K"]:
        """The pessimistic critic's value of each action."""
        ...


@dataclass(frozen=True)
class Task:
    """An address and a way to see: it owns no loop, no reward and no network."""

    suite: str
    """File name under `hcpg/suites`."""
    env_id: str
    """The suite's own name of the environment."""
    horizon: int
    """Steps until the time limit (a truncation, which bootstraps)."""
    control: str
    """Control mode, and what one unit of action does."""
    adapters: Mapping[str, ReadScene]
    """Readers of the scene by family: `paper` (the paper's reading), `contact` (ours)."""
    robot: "RobotTask | None" = None
    """What it adds where an arm does it; the suite that simulates the arm observes in the same way."""


@runtime_checkable
class Environment(Protocol):
    """One simulator, one episode at a time; NumPy in and out; never resets itself."""

    def reset(self, start: int) -> Float[Tensor, " O"]:
        """The first observation of start state `start`, any integer >= 0; the same one every time.

        A finite suite of start states wraps around.
        """
        ...

    def step(self, action: Float[Tensor, " A"]) -> Step:
        """The answer to one action in [-1, 1]; it never reports a time limit."""
        ...

    def render(self) -> UInt8[Tensor, "H W 3"]:
        """The scene as an RGB picture; `RenderingError` where this machine cannot draw."""
        ...

    def close(self) -> None:
        """Free the simulator; safe to call twice."""
        ...


@runtime_checkable
class Suite(Protocol):
    """One simulator package; the module's `SUITE`."""

    def spec(self, task: Task) -> Spec:
        """The task's sizes, without building the simulator where they are known."""
        ...

    def make(self, task: Task, seed: int) -> Environment:
        """An environment whose start states are the set that `seed` names.

        Two environments made with one seed have equal start states; sets of different seeds are
        disjoint (that is how evaluation stays apart from training).
        """
        ...


@runtime_checkable
class Clock(Protocol):
    """Time, and waiting: of this machine, or of a simulation that runs while one waits."""

    def now_s(self) -> float:
        """Seconds since an arbitrary moment; never goes back."""
        ...

    def sleep_until(self, time_s: float) -> None:
        """Return at `time_s` or as soon after it as possible; at once if it has passed."""
        ...


@runtime_checkable
class Robot(Protocol):
    """One arm: it carries out, the control loop decides and limits.

    Only `connect`, `recover` and `reset` may block, each at most for its time limit. `stop` may come from any
    thread or signal handler, any number of times; after it, no command is carried out until `connect`.
    """

    @property
    def limits(self) -> Limits:
        """What it may do, set in the robot's own file."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock of all its times. A twin in this process waits by running its physics."""
        ...

    def connect(self, timeout_s: float) -> Info:
        """Connect (again), check what must hold before motion, hold still; a new epoch begins.

        Raises:
            RobotError: no answer, or a check that failed; the message says which and the cure.
        """
        ...

    def observe(self) -> Snapshot:
        """The newest state at once, however old: it never waits for the robot."""
        ...

    def command(self, command: Command) -> Ack:
        """Move the target there, unless the command is old, or lies outside the box or the lead."""
        ...

    def hold(self) -> None:
        """Make the measured position the target, once: further calls, or any after a stop, do nothing."""
        ...

    def stop(self, reason: str) -> None:
        """Stop for good: hold, refuse whatever comes, end the motion. A new epoch begins."""
        ...

    def recover(self, timeout_s: float) -> Recovery:
        """Clear a reflex and hold where the arm is now; a new epoch begins, whatever was queued is gone."""
        ...

    def reset(self, position: tuple[float, float, float], grip: Grip, timeout_s: float) -> None:
        """Move slowly to a start pose (m) and hold there; a new epoch begins.

        Raises:
            RobotError: it did not get there in time, or a reflex stopped it.
        """
        ...

    def close(self) -> None:
        """Stop and let the connection go; safe to call twice."""
        ...


@runtime_checkable
class Perception(Protocol):
    """Where the task's objects are."""

    @property
    def age_limit_s(self) -> float:
        """A sighting older than this is not to be acted on."""
        ...

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """The newest sightings at once, each with its age; it never waits for a camera."""
        ...

    def forget(self) -> None:
        """Drop what was seen of things that move: the scene was laid out anew."""
        ...


@runtime_checkable
class Stage(Protocol):
    """Whoever lays out a scene: the twin itself, or a person who is asked to."""

    def arrange(self, start: int) -> None:
        """Lay out start state `start`, any integer >= 0; the same layout every time. The arm is at home."""
        ...

    def close(self) -> None:
        """Let go of what it uses; safe to call twice."""
        ...


@runtime_checkable
class Detector(Protocol):
    """Says when the task is done, by means other than the selector's geometry."""

    def update(self, snapshot: Snapshot, sight: Sight) -> bool:
        """Whether the task is done, after one more tick."""
        ...


@dataclass(frozen=True)
class RobotTask:
    """What a task adds where an arm does it; `ROBOT_TASK` in the task's file, beside its `TASK`."""

    observation_size: int
    action_size: int
    """3: a delta of the position; 4: and the gripper."""
    objects: tuple[str, ...]
    """Names of what perception has to find."""
    observe: Callable[[Snapshot, Sight], Float[Tensor, " O"]]
    """The observation that the policy and the task's adapters read."""
    home: tuple[float, float, float]
    """Where an episode starts, m."""
    home_grip: Grip
    make_detector: Callable[[], Detector]


class Rig(NamedTuple):
    """A robot ready for one task, with its eyes and whoever lays out its scene."""

    robot: Robot
    perception: Perception
    stage: Stage


@runtime_checkable
class RobotPlugin(Protocol):
    """One kind of arm; the module's `ROBOT` in `robots/<name>.py`."""

    @property
    def kind(self) -> Kind:
        """Whether a real arm moves."""
        ...

    def make(self, task: str, address: str | None) -> Rig:
        """A rig for the task `suite/name`, not connected yet; `address` is its controller's, if it has one.

        Raises:
            RobotError: this robot cannot do the task, or lacks its driver; the message says the cure.
        """
        ...


@runtime_checkable
class EnvironmentBatch(Protocol):
    """N environments of one task that one call steps, all in one rhythm; arrays out are JAX's or NumPy's."""

    def reset(self, starts: Int[Tensor, " N"]) -> Float[Tensor, "N O"]:
        """The first observations of start state `starts[n]` of each environment n."""
        ...

    def step(
        self, actions: Float[Tensor, "N A"]
    ) -> tuple[Float[Tensor, "N O"], Float[Tensor, " N"], Bool[Tensor, " N"]]:
        """Observations, rewards and successes; it never reports a time limit, and no task ends by itself."""
        ...

    def close(self) -> None:
        """Free the simulator; safe to call twice."""
        ...


@runtime_checkable
class BatchedSuite(Protocol):
    """What a suite offers too whose simulator steps many environments at once on an accelerator."""

    def make_batch(self, task: Task, seeds: Sequence[int]) -> EnvironmentBatch:
        """Environment n with the start states that `seeds[n]` names, the same ones that `make` gives it."""
        ...
