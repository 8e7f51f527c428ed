"""The sockets: what a method, a suite, an environment and a task must offer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

from hcpg.types import Batch, Float, Sampling, Scene, Spec, Step, Tensor, UInt8

Metrics = Mapping[str, Tensor]
ReadScene = Callable[[Float[Tensor, "*batch O"]], Scene]


@runtime_checkable
class Method(Protocol):
    """A learner bound to its `config` and `spec`; every call is pure.

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
        """The scene as an RGB picture."""
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
