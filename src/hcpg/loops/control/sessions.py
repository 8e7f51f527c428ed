"""Episode after episode on one robot; however it ends, the robot is stopped and let go."""

from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple, Protocol, runtime_checkable

from hcpg.interfaces import Rig, RobotTask
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.episodes import Crew, Episode
from hcpg.loops.control.mending import Mender, Patience
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.step_log import StepLog
from hcpg.loops.control.workers import Worker, passes_by_itself, worker_for

Purpose = Literal["train", "evaluate"]
SETTLES_S = 0.5
"""From the laying out to the first picture that counts."""


@runtime_checkable
class Learner(Protocol):
    """The learner's process, as the robot's process sees it."""

    def alive(self) -> bool:
        """Whether it still learns."""
        ...

    def offer(self, result: EpisodeResult) -> None:
        """Hand over an episode; it never waits."""
        ...


class SessionResult(NamedTuple):
    """What a session did, and why it ended."""

    episodes: tuple[EpisodeResult, ...]
    ended: str
    """"" if every start state was run, else the reason."""
    signal: int | None = None
    """The signal that stopped it, if one did."""


class Session:
    """Runs episodes with one crew."""

    def __init__(self, crew: Crew, calls: Worker, horizon: int, patience: Patience | None = None) -> None:
        """`calls` makes the robot's blocking calls."""
        self._crew, self._calls = crew, calls
        self.horizon = horizon
        """The most actions of an episode; it may change from one to the next."""
        self._mender = Mender(crew, calls, patience or Patience())
        self._told = False

    @classmethod
    def of(cls, rig: Rig, task: RobotTask, chooser: Chooser, log: Path, horizon: int) -> "Session":
        """A session with the workers that the robot's clock calls for; steps go to the file `log`.

        Raises:
            LogError: there is no room for the log.
        """
        clock = rig.robot.clock
        steps = StepLog(log, threaded=passes_by_itself(clock))
        crew = Crew.of(rig, task, chooser, worker_for(clock, "policy"), steps)
        return cls(crew, worker_for(clock, "robot calls"), horizon)

    @property
    def stopped(self) -> str:
        """Why it ends at the next chance; "" if nothing asks for it."""
        return self._mender.stopped()

    def run(
        self,
        starts: Iterable[int],
        purpose: Purpose = "evaluate",
        learner: Learner | None = None,
        first: int = 0,
    ) -> SessionResult:
        """One episode per start state, until they are done or something ends the session.

        The stage is not closed: it belongs to whoever made the rig. `first` is the number of the first
        episode: a run that is taken up again goes on counting.

        Raises:
            LogError: steps could not be written at all.
            Exception: whatever the policy raised; the robot is stopped.
        """
        results: list[EpisodeResult] = []
        try:
            with self._crew.button:
                ended = self._mender.connect()
                for number, start in enumerate(starts, first):
                    ended = ended or self._unlearned(purpose, learner) or self._prepared(start)
                    if ended:
                        break
                    results.append(self._episode(number, start))
                    if learner is not None and learner.alive():
                        learner.offer(results[-1])
                    ended = self._settled(results[-1])
        finally:
            self._let_go()
        return SessionResult(tuple(results), ended, self._crew.button.signal)

    def _prepared(self, start: int) -> str:
        """The arm goes home before anybody, or anything, lays the scene out."""
        ended = self._mender.reset()
        if ended:
            return ended
        rig = self._crew.rig
        rig.stage.arrange(start)
        rig.robot.clock.sleep_until(rig.robot.clock.now_s() + SETTLES_S)
        rig.perception.forget()
        return self._mender.stopped()

    def _episode(self, number: int, start: int) -> EpisodeResult:
        result = Episode(self._crew, number, start, self.horizon).run()
        self._crew.log.put(result.row(number))
        return result

    def _settled(self, result: EpisodeResult) -> str:
        """From an episode's end to a robot that holds; "" once it does, else why the session ends."""
        if result.verdict.state == "stop":
            return result.verdict.cause
        if result.ended == "fault":
            return self._mender.mend(result.verdict.state)
        self._mender.went_well()
        return ""

    def _unlearned(self, purpose: Purpose, learner: Learner | None) -> str:
        """Why training cannot go on; evaluation goes on without a learner, and the log says so."""
        if learner is None or learner.alive():
            return ""
        if purpose == "train":
            return "the learner died, so training stops here"
        if not self._told:
            self._mender.note("hold", "the learner died; evaluation goes on with the last policy")
            self._told = True
        return ""

    def _let_go(self) -> None:
        robot = self._crew.rig.robot
        robot.hold()
        robot.stop("the session ends")
        robot.close()
        self._crew.worker.close()
        self._calls.close()
        self._crew.log.close()
