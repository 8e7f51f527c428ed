"""Learning on an arm under a budget of executed actions; the log of the steps is the budget's book.

What was executed counts, whether its episode ended well, in a fault, or not at all because the program was
killed. A run that is taken up again learns first from what its log has and its checkpoint has not.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array

from hcpg import presets, registry
from hcpg.interfaces import Method, Rig
from hcpg.loops import checkpoints, learning, online_learner
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.experience import Experience, experienced, recovered
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Session, SessionResult
from hcpg.loops.learner_process import LearnerProcess, Word
from hcpg.loops.once import once
from hcpg.loops.runs import RunFolder
from hcpg.loops.sitting import create_folders, seed_of
from hcpg.loops.streams import Stream, key
from hcpg.loops.trained import Trained
from hcpg.presets import Settings
from hcpg.report.durable import replace_json
from hcpg.report.rows import complete_lines
from hcpg.types import Float

FACTS = "learning.json"
LOG = "steps_{:03d}.jsonl"
"""One for each sitting, in the run's folder."""
FIRST_START = 1_000_000
"""Start states of learning begin here: below are those of trials and of demonstrations."""


class OnlineError(RuntimeError):
    """A run that cannot be begun or taken up as asked; the message says why and the cure."""


class Sources(NamedTuple):
    """What a run starts from; the same for every method that is compared."""

    initial: Trained
    demonstrations: Path
    digest: str
    """Of the demonstrations."""


def begin(settings: Settings, seed: int, root: Path, sources: Sources) -> RunFolder:
    """A new run folder under `root`, with the initial policy as its checkpoint at step 0.

    Raises:
        OnlineError: the initial policy is of another task, or of another learner.
    """
    found = sources.initial
    theirs, ours = found.settings, settings
    if theirs.task != ours.task:
        raise OnlineError(f"{found.folder.path} is a policy for {theirs.task}, not for {ours.task}.")
    if (theirs.method, theirs.learner) != (ours.method, ours.learner):
        raise OnlineError(
            f"{found.folder.path} was made with the learner {theirs.method} {theirs.learner}, this run has "
            f"{ours.method} {ours.learner}. Clone anew with the same settings, or choose a preset that fits."
        )
    [folder] = create_folders(settings, [seed], root)
    state = jax.tree.map(lambda leaf: leaf[0], found.states._replace(updates=None))
    online_learner.begin(folder, state._replace(updates=found.states.updates), found.method.spec)
    facts = {
        "initial": {"path": str(found.folder.path), "step": found.step, "sha256": _digest(found)},
        "demonstrations": {"path": str(sources.demonstrations), "sha256": sources.digest},
        "first_start": first_start(seed),
    }
    replace_json(folder.path / FACTS, facts)
    return folder


def first_start(seed: int) -> int:
    """The start state of a run's first episode; the following ones count on, for every method alike."""
    return FIRST_START + 10_000 * seed


def facts_of(folder: RunFolder) -> dict[str, Any]:
    """What a run started from, as `begin` wrote it down.

    Raises:
        OnlineError: the run was not begun here.
    """
    file = folder.path / FACTS
    if not file.is_file():
        raise OnlineError(f"{folder.path} has no {FACTS}: it was not begun by hcpg robot learn.")
    return json.loads(file.read_text())


@once
def proposing(method: Method) -> Callable[..., Array]:
    """Proposals, compiled: (state, observation [O], count, root key, number of the draw) -> [count, A]."""

    def propose(state: Any, observation: Array, count: int, root: Array, draw: Array) -> Array:
        return method.propose(state, observation, jax.random.fold_in(root, draw), count)

    return jax.jit(propose, static_argnums=2)


class Policy:
    """The flow's proposals by the newest checkpoint; a draw depends on the seed and its number alone."""

    def __init__(self, settings: Settings, seed: int) -> None:
        task = registry.task(settings.task)
        spec = registry.suite(task.suite).spec(task)
        method = registry.method(settings.method).METHOD(settings.learner, spec)
        self._template = learning.initial(method)(key(seed, Stream.NETWORKS))
        self._root, self._state = key(seed, Stream.ACTOR), self._template
        self._propose = proposing(method)
        self._nothing = np.zeros(spec.observation_size, np.float32)
        self._counts = {1, settings.selector.candidates}

    def load(self, checkpoint: Path) -> None:
        """Act by this checkpoint from now on; what it needs is compiled here, before anything moves."""
        self._state = checkpoints.load(checkpoint, {"state": self._template})[0]["state"]
        for count in self._counts:
            self(self._nothing, count, 0)

    def __call__(
        self, observation: Float[np.ndarray, " O"], count: int, draw: int
    ) -> Float[np.ndarray, "K A"]:
        """`count` proposals for one observation."""
        return np.asarray(self._propose(self._state, observation, count, self._root, draw))


class OnlineRun:
    """One sitting of a run on an arm; to the session it is the learner."""

    def __init__(self, folder: RunFolder, rig: Rig, tell: Callable[[str], None]) -> None:
        """`tell` is given a line per episode.

        Raises:
            OnlineError: the run was not begun here.
            CheckpointError: it has no sound checkpoint.
        """
        self._folder, self._rig, self._tell = folder, rig, tell
        self._facts, self._settings = facts_of(folder), presets.from_json(folder.config())
        self._task = registry.robot_task(self._settings.task)
        self._horizon = registry.task(self._settings.task).horizon
        self.spent = online_learner.progress_of(folder).executed
        """Actions charged to the budget."""
        self._number = online_learner.progress_of(folder).episodes
        self._policy = Policy(self._settings, seed_of(folder))
        self._process: LearnerProcess
        self._session: Session

    def run(self) -> SessionResult:
        """Episodes until the budget is spent, or something ends the session.

        Raises:
            LearnerError: the learner ended.
        """
        shown, log = Path(self._facts["demonstrations"]["path"]), self._folder.path / "learner.txt"
        logs = sorted(self._folder.path.glob(LOG.replace("{:03d}", "*")))
        self._process = LearnerProcess(self._folder.path, shown, self._settings.task, log)
        try:
            self._await(lambda: False)
            self._recover(logs)
            self._session = self._new_session(self._folder.path / LOG.format(len(logs)))
            self._folder.set_status("running", step=self.spent)
            done = self._session.run(self._starts(), "train", self, self._number)
            self._await(lambda: False)
            return done
        finally:
            self._process.close()
            if self._folder.status()["state"] != "diverged":
                spent_all = self.spent >= self._settings.budget.steps
                self._folder.set_status("finished" if spent_all else "stopped", step=self.spent)

    def alive(self) -> bool:
        """Whether the learner is."""
        return self._process.alive()

    def offer(self, result: EpisodeResult) -> None:
        """Charge an episode to the budget and hand it to the learner."""
        self._give(experienced(self._number, result, self._task))

    def _give(self, episode: Experience) -> None:
        self.spent += episode.actions
        self._number += 1
        self._process.give(episode)
        told = "success" if episode.success else episode.ended
        self._tell(f"episode {episode.number}, start {episode.start}: {told}, {episode.actions} actions; "
                   f"{self.spent} of {self._settings.budget.steps} spent")  # fmt: skip

    def _starts(self) -> Iterator[int]:
        """Start states, each once the learner has learned from the episode before it."""
        while self.spent < self._settings.budget.steps:
            if self.alive():
                self._await(lambda: bool(self._session.stopped))
            self._session.horizon = min(self._horizon, self._settings.budget.steps - self.spent)
            yield self._start(self._number)

    def _await(self, stop: Callable[[], bool]) -> None:
        """Act by what the learner made of all that it was given."""
        word: Word | None = None
        while (told := self._process.word(stop)) is not None:
            word = told
        if word is not None:
            checkpoint = checkpoints.latest(self._folder.checkpoints)
            assert checkpoint is not None  # the learner has just written it
            self._policy.load(checkpoint)

    def _recover(self, logs: list[Path]) -> None:
        """Charge, and learn from, episodes that were executed and that no checkpoint has."""
        for number, rows in sorted(_episodes(logs).items()):
            if number >= self._number:
                self._number = number
                self._give(recovered(number, self._start(number), rows, self._task))
        self._await(lambda: False)

    def _start(self, number: int) -> int:
        return self._facts["first_start"] + number

    def _new_session(self, log: Path) -> Session:
        settings, task = self._settings, registry.task(self._settings.task)
        read_scene, size = task.adapters[settings.adapter], self._task.action_size
        chooser = Chooser(self._policy, settings.selector, read_scene, size, seed_of(self._folder))
        return Session.of(self._rig, self._task, chooser, log, self._horizon)


def _episodes(logs: list[Path]) -> dict[int, list[dict[str, Any]]]:
    """The ticks of every episode in which something was executed, by the episode's number."""
    found: dict[int, list[dict[str, Any]]] = {}
    lines = (line for log in logs for line in complete_lines(log).splitlines())
    for row in map(json.loads, lines):
        if row["kind"] == "step":
            found.setdefault(row["episode"], []).append(row)
    return {number: rows for number, rows in found.items() if any(row["executed"] for row in rows)}


def _digest(found: Trained) -> str:
    path = checkpoints.latest(found.folder.checkpoints, not_after=found.step)
    assert path is not None  # it was loaded
    return json.loads((path / "facts.json").read_text())["sha256"]
