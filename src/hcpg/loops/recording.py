"""Record demonstrations: somebody proposes, the control loop limits, executes and writes down."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg import registry
from hcpg.interfaces import Clock, Rig
from hcpg.loops.control.choosing import Chooser, Propose
from hcpg.loops.control.episodes import DRAWS_PER_EPISODE
from hcpg.loops.control.experience import STEP_REWARD, SUCCESS_REWARD, experienced
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Session, SessionResult
from hcpg.loops.control.step_log import plain
from hcpg.loops.control.workers import passes_by_itself
from hcpg.loops.demonstrations import DemonstrationError, DemonstrationFolder
from hcpg.report.checkout import own_code
from hcpg.safety.clock import MachineClock
from hcpg.selection import Selector
from hcpg.types import Float

FIRST_START = 10_000
"""Start states of demonstrations begin here: below are those of trials."""
SPEEDS, NOISE = (0.65, 0.85), 0.2
"""Of a scripted expert: its longest step, drawn anew for each episode; the deviation of what disturbs it."""
ATTEMPTS = 2
"""Episodes run at most, for each demonstration wanted."""
ALONE = Selector("first", candidates=1)


class Source(NamedTuple):
    """Who shows the task."""

    proposer: AbstractContextManager[Propose]
    facts: Mapping[str, Any]
    """For the manifest."""


class Order(NamedTuple):
    """What to record."""

    task: str
    robot: str
    kind: str
    """`Kind` of what moves."""
    wanted: int
    """Demonstrations; only episodes that succeed count."""
    seed: int


class Expert:
    """A scripted expert, slowed down and disturbed; a draw depends on the seed and its number alone."""

    def __init__(self, expert: Callable[[float], Propose], seed: int) -> None:
        """`expert` gives one that goes at a share of full speed in (0, 1]."""
        self._expert, self._seed = expert, seed

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """What it does now, `count` times the same."""
        episode = draw // DRAWS_PER_EPISODE
        speed = float(np.random.default_rng([self._seed, 0, episode]).uniform(*SPEEDS))
        actions = np.array(self._expert(speed)(observation, count, draw), np.float64)
        actions[:, :3] += NOISE * np.random.default_rng([self._seed, 1, draw]).normal(size=3)
        return np.clip(actions, -1.0, 1.0)


class Paced:
    """Proposals at 30 Hz of real time where the robot's own time would run ahead of a person."""

    def __init__(self, propose: Propose, rate_hz: float, clock: Clock | None = None) -> None:
        self._propose, self._period_s, self._clock = propose, 1.0 / rate_hz, clock or MachineClock()
        self._due_s = -np.inf

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """The proposals of a period after the last ones."""
        self._clock.sleep_until(self._due_s)
        self._due_s = max(self._due_s, self._clock.now_s()) + self._period_s
        return self._propose(observation, count, draw)


def scripted(expert: Callable[[float], Propose], seed: int) -> Source:
    """A script that sees the truth, at any share of full speed, in the place of a person."""
    facts = {
        "name": "expert",
        "stand_in": "a script that sees the truth, slowed down and disturbed, in the place of a person",
        "speeds": SPEEDS,
        "noise": NOISE,
    }
    return Source(nullcontext(Expert(expert, seed)), facts)


class Recorder:
    """Keeps episodes that succeed until there are enough; a session offers them as to a learner."""

    def __init__(self, folder: DemonstrationFolder, order: Order) -> None:
        self._folder, self._order, self._number = folder, order, 0

    def alive(self) -> bool:
        """It does not die."""
        return True

    def offer(self, result: EpisodeResult) -> None:
        """Write the episode down."""
        self._folder.add(experienced(self._number, result, registry.robot_task(self._order.task)))
        self._number += 1

    def starts(self) -> Iterator[int]:
        """Start states, until enough episodes are kept or too many were tried."""
        first = FIRST_START + 1000 * self._order.seed
        for attempt in range(ATTEMPTS * self._order.wanted):
            if self._folder.kept == self._order.wanted:
                return
            yield first + attempt


def record(order: Order, rig: Rig, source: Source, path: Path, command: str) -> SessionResult:
    """Record into the new folder `path`; what was kept is in its manifest, however the session ends.

    Raises:
        DemonstrationError: the folder is not empty, or the session ended before enough was kept.
    """
    facts, task = registry.task(order.task), registry.robot_task(order.task)
    folder = DemonstrationFolder(path, _facts(order, rig, source, command))
    recorder = Recorder(folder, order)
    with source.proposer as propose:
        own_time = passes_by_itself(rig.robot.clock) or isinstance(propose, Expert)
        paced = propose if own_time else Paced(propose, rig.robot.limits.rate_hz)
        chooser = Chooser(paced, ALONE, facts.adapters["paper"], task.action_size, order.seed)
        session = Session.of(rig, task, chooser, path / "steps.jsonl", facts.horizon)
        done = session.run(recorder.starts(), "evaluate", recorder)
    if folder.kept < order.wanted and not done.ended:
        raise DemonstrationError(
            f"{folder.kept} of {len(done.episodes)} episodes succeeded, {order.wanted} were wanted. "
            f"They are in {path}; look at the others' steps there before recording again."
        )
    return done


def _facts(order: Order, rig: Rig, source: Source, command: str) -> dict[str, Any]:
    task = registry.robot_task(order.task)
    return {
        "task": order.task,
        "control": registry.task(order.task).control,
        "observation_size": task.observation_size,
        "action_size": task.action_size,
        "robot": order.robot,
        "kind": order.kind,
        "source": dict(source.facts),
        "seed": order.seed,
        "limits": plain(rig.robot.limits),
        "rewards": {"success": SUCCESS_REWARD, "step": STEP_REWARD},
        "time": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        "command": command,
        "code": own_code(),
    }
