"""The way back to a robot that holds: connect, recover from a reflex, bring the arm to its start."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from hcpg.loops.control.episodes import Crew
from hcpg.loops.control.states import State
from hcpg.loops.control.workers import Worker
from hcpg.robot_types import Recovery, RobotError

GRACE = 1.5
"""A blocking call is given up after this many times its time limit: the driver's own limit comes first."""


@dataclass(frozen=True)
class Patience:
    """How long to wait for a robot."""

    connect_s: float = 10.0
    reset_s: float = 15.0
    recover_s: float = 10.0
    """Recovery took up to 7.3 s on others' hardware."""
    pause_s: float = 0.5
    """Before the second attempt in a row; doubled with every further one."""
    connects: int = 3
    """Attempts to connect before a person has to look."""


class Mender:
    """Makes the robot's blocking calls, in bounded time. Each method gives "" or why the session must end."""

    def __init__(self, crew: Crew, calls: Worker, patience: Patience) -> None:
        """`calls` makes the calls, so that one that hangs costs its time limit and no more."""
        self._crew, self._robot, self._calls, self._patience = crew, crew.rig.robot, calls, patience
        self._ticket, self._faults_in_a_row = 0, 0

    def connect(self) -> str:
        """Connect (again), in a few attempts."""
        for attempt in range(self._patience.connects):
            if self._paused(attempt):
                break
            self.enter("reconnect", f"attempt {attempt + 1}")
            info, error = self._call(self._robot.connect, self._patience.connect_s)
            if error is None:
                self._crew.log.put({"kind": "connected", "info": info, "limits": self._robot.limits})
                self.enter("hold", "connected")
                return self.stopped()
            self.note("reconnect", str(error))
        return self.stopped() or "the robot cannot be reached; look at it before going on"

    def reset(self) -> str:
        """Bring the arm to the task's start; a fault on the way is mended, within the limits."""
        go = partial(self._robot.reset, self._crew.task.home, self._crew.task.home_grip)
        while not self.stopped():
            _, error = self._call(go, self._patience.reset_s)
            if error is None:
                return ""
            self.note("hold", f"reset: {error}")
            lost = self._robot.observe().mode == "disconnected"
            ended = self.mend("reconnect" if lost else "reflex")
            if ended:
                return ended
        return self.stopped()

    def mend(self, state: State) -> str:
        """From a fault, and the state it left the loop in, to a robot that holds."""
        self._faults_in_a_row += 1
        if self._faults_in_a_row > self._robot.limits.recoveries:
            return f"{self._faults_in_a_row} faults in a row; look at the robot before going on"
        if state == "reconnect":
            return self.connect()
        return self._recover() if state == "reflex" else self.stopped()

    def went_well(self) -> None:
        """An episode ended without a fault: whatever was before does not count any more."""
        self._faults_in_a_row = 0

    def stopped(self) -> str:
        """Why the session has to end at once; "" if nothing asks for it."""
        return self._crew.button.reason or self._crew.log.failure

    def enter(self, state: State, cause: str) -> None:
        """Move the loop's machine to `state`, and say so in the log."""
        self._crew.machine.move(state)
        self.note(state, cause)

    def note(self, state: State, cause: str) -> None:
        """Write an event into the log."""
        time_s = self._robot.clock.now_s()
        self._crew.log.put({"kind": "event", "time_s": time_s, "state": state, "cause": cause})

    def _recover(self) -> str:
        self.enter("reflex", "to be cleared")
        for attempt in range(self._robot.limits.recoveries):
            if self._paused(attempt):
                break
            self.enter("recover", f"attempt {attempt + 1}")
            value, error = self._call(self._robot.recover, self._patience.recover_s)
            recovery = value if error is None else Recovery(False, False, str(error))
            if recovery.recovered:
                self.enter("hold", "recovered")
                return self.stopped()
            self.note("recover", recovery.reason)
            if recovery.reconnect:
                return self.connect()
        return self.stopped() or "the robot did not recover; look at it before going on"

    def _paused(self, attempt: int) -> str:
        """Wait before a further attempt; gives why not to make it."""
        if attempt:
            clock = self._robot.clock
            clock.sleep_until(clock.now_s() + self._patience.pause_s * 2 ** (attempt - 1))
        return self.stopped()

    def _call(self, call: Callable[[float], Any], limit_s: float) -> tuple[Any, RobotError | None]:
        """What a blocking call gave, or the error with which it gave up.

        Raises:
            Exception: what the driver raised and did not mean to.
        """
        self._ticket += 1
        until_s = self._robot.clock.now_s() + GRACE * limit_s
        asked = self._calls.ask(self._ticket, lambda: call(limit_s))
        answer = self._calls.answer(self._ticket, until_s) if asked else None
        if answer is None:
            return None, RobotError(f"no answer within {GRACE * limit_s:.1f} s; restart the controller")
        if answer.error is not None and not isinstance(answer.error, RobotError):
            raise answer.error
        return answer.value, answer.error
