"""Many environments in worker processes, stepped together; the parent is free while they work.

The result does not depend on the number of workers. Processes are spawned, not forked (the parent has JAX
threads), so a script that makes a pool needs the usual `if __name__ == "__main__":`.
"""

import multiprocessing
import os
import select
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from multiprocessing.util import Finalize
from typing import Any, NamedTuple, NoReturn

import numpy as np

from hcpg import registry
from hcpg.loops.worker import NOBODY, Board, Post, Sizes, board_bytes, board_in, serve
from hcpg.types import Bool, Float, Int, RenderingError, Spec, Tensor, UInt8

GRACE_S = 5.0
"""How long `close` lets a worker finish its step before it is killed."""
SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""One worker, one core: set to 1 before the worker's NumPy starts."""


class WorkerError(RuntimeError):
    """A worker crashed, hung, or its simulator raised an error; the message names the environment."""


class Arrival(NamedTuple):
    """What one step of all N environments brought."""

    observations: Float[Tensor, "N O"]
    """To act on next: after the reset where an episode ended."""
    next_observations: Float[Tensor, "N O"]
    """The true last observation of this step; equal to `observations` where no episode ended."""
    rewards: Float[np.ndarray, " N"]
    terminated: Bool[np.ndarray, " N"]
    """The task itself ended."""
    truncated: Bool[np.ndarray, " N"]
    """The time limit was reached and the task had not ended."""
    success: Bool[np.ndarray, " N"]
    """The task's condition held after this step."""


class Pool:
    """N environments of one task, spread over worker processes."""

    spec: Spec
    """Sizes of the task."""
    size: int
    """Number of environments, N."""
    timeout_s: float
    """How long an answer may take before a worker counts as hung."""
    exact = True
    """Whether the same start and actions bring the same observations, bit for bit."""

    def __init__(
        self,
        task: str,
        seeds: Sequence[int],
        *,
        workers: int,
        horizon: int | None = None,
        timeout_s: float = 120.0,
    ) -> None:
        """Start the workers and build environment e with `seeds[e]`; episodes are cut after `horizon` steps.

        Without a `horizon` they are cut where the task says.

        Raises:
            ValueError: no seeds, or less than one worker.
            WorkerError: an environment could not be built.
            RenderingError: MUJOCO_GL names a library that this machine does not have.
        """
        if len(seeds) == 0 or workers < 1:
            raise ValueError(f"a pool needs at least one seed and one worker, got {len(seeds)} and {workers}")
        address = registry.task(task)
        self.spec = registry.suite(address.suite).spec(address)
        self.size, self.timeout_s = len(seeds), timeout_s
        self._task, self._seeds, self._waiting = task, [int(seed) for seed in seeds], False
        sizes = Sizes(self.size, *self.spec, workers=min(workers, self.size))
        memory = SharedMemory(create=True, size=board_bytes(sizes))
        self._board: Board = board_in(memory, sizes)  # before the memory: freed in this order, too
        self._memory: SharedMemory | None = memory
        self._board.busy[:] = NOBODY
        self._starts = np.full(self.size, -1)
        self._shares = np.array_split(np.arange(self.size), sizes.workers)
        self._crew = _Crew()
        self._finalizer = Finalize(self, self._crew.dismiss, exitpriority=1)
        try:
            for worker, share in enumerate(self._shares):
                seeds_of = {int(index): self._seeds[index] for index in share}
                self._crew.hire(Post(worker, task, seeds_of, sizes, memory.name, horizon or address.horizon))
            self._answers()
        except BaseException:
            self.close()
            raise
        finally:
            memory.unlink()  # everybody has it open: without a name nothing can leak, come what may

    def reset(self, starts: Int[np.ndarray, " N"]) -> Float[np.ndarray, "N O"]:
        """The first observations of the given start states."""
        self._begin(starts)
        self._ask("reset")
        self._answers()
        return self._board.observations.copy()

    def send(self, actions: Float[np.ndarray, "N A"], next_starts: Int[np.ndarray, " N"]) -> None:
        """Hand out one action per environment and return at once; `receive` brings what came of it.

        Where an episode ends with this step, the environment begins again from its entry of `next_starts`.

        Raises:
            ValueError: the actions are not N x A.
        """
        if actions.shape != self._board.actions.shape:
            raise ValueError(
                f"actions have the shape {actions.shape}; {self._task} needs {self._board.actions.shape}"
            )
        self._board.actions[:] = actions
        self._board.starts[:] = next_starts
        self._ask("step")

    def receive(self) -> Arrival:
        """What the actions last sent brought; waits for the slowest worker. The caller may keep the arrays.

        Raises:
            WorkerError: a worker crashed, hung or raised an error; nothing but `close` makes sense then.
            RuntimeError: nothing was sent.
        """
        if not self._waiting:
            raise RuntimeError("receive() without send(): there is nothing to wait for")
        self._answers()
        board = self._board
        arrival = Arrival(
            board.observations.copy(),
            board.next_observations.copy(),
            board.rewards.copy(),
            board.terminated.copy(),
            board.truncated.copy(),
            board.success.copy(),
        )
        ended = arrival.terminated | arrival.truncated
        self._starts[ended] = board.starts[ended]
        return arrival

    def restore(
        self, starts: Int[np.ndarray, " N"], actions: Sequence[Float[np.ndarray, "_ A"]]
    ) -> Float[np.ndarray, "N O"]:
        """The observations after each start state and its own list of actions.

        Continues every episode exactly where a checkpoint left it; the lists may differ in length.
        """
        self._begin(starts)
        for worker, share in enumerate(self._shares):
            self._tell(worker, "restore", {int(index): actions[index] for index in share})
        self._waiting = True
        self._answers()
        return self._board.observations.copy()

    def render(self, environment: int) -> UInt8[np.ndarray, "H W 3"]:
        """A picture of one environment; not between `send` and `receive`.

        Raises:
            RenderingError: this machine cannot draw; nothing but `close` makes sense then.
        """
        worker = next(w for w, share in enumerate(self._shares) if environment in share)
        self._tell(worker, "render", environment)
        return self._answer(worker, time.monotonic() + self.timeout_s)

    def close(self) -> None:
        """End the workers and free the shared memory; safe to call twice."""
        self._finalizer()
        if self._memory is not None:
            del self._board
            self._memory.close()
            self._memory = None

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _begin(self, starts: Int[np.ndarray, " N"]) -> None:
        self._board.starts[:] = starts
        self._starts[:] = starts

    def _ask(self, command: str) -> None:
        for worker in range(len(self._shares)):
            self._tell(worker, command)
        self._waiting = True

    def _tell(self, worker: int, command: str, *arguments: Any) -> None:
        if self._waiting:
            raise RuntimeError(f"{command} before the answer to the last command; call receive() first")
        try:
            self._crew.connections[worker].send((command, arguments))
        except (BrokenPipeError, ConnectionResetError):
            self._report_death(worker)

    def _answers(self) -> None:
        deadline = time.monotonic() + self.timeout_s
        for worker in range(len(self._shares)):
            self._answer(worker, deadline)
        self._waiting = False

    def _answer(self, worker: int, deadline: float) -> Any:
        connection = self._crew.connections[worker]
        try:
            if not self._crew.pollers[worker].poll(max(0.0, deadline - time.monotonic()) * 1000):
                self._crew.processes[worker].kill()
                cure = "if its simulator is only slow, make the pool with a larger timeout_s"
                self._report(worker, f"gave no answer within {self.timeout_s:g} s and was killed; {cure}")
            failure, result = connection.recv()
        except (EOFError, ConnectionResetError):
            self._report_death(worker)
        if isinstance(failure, RenderingError):
            raise failure
        if failure is not None:
            self._report(worker, f"raised an error:\n{failure}")
        return result

    def _report_death(self, worker: int) -> NoReturn:
        process = self._crew.processes[worker]
        process.join(GRACE_S)
        code = process.exitcode
        how = (
            f"exit code {code}"
            if code is None or code >= 0
            else f"signal {-code} ({signal.strsignal(-code)})"
        )
        hint = "; if nobody sent it, the system ran out of memory: use fewer workers" if code == -9 else ""
        self._report(worker, f"died with {how}{hint}")

    def _report(self, worker: int, what: str) -> NoReturn:
        index = int(self._board.busy[worker])
        share = self._shares[worker] if index == NOBODY else [index]
        places = [
            f"environment {e} (seed {self._seeds[e]}, start state {self._starts[e]}, "
            f"last action {self._board.actions[e].tolist()})"
            for e in share
        ]
        raise WorkerError(f"{self._task}: worker {worker} with {'; '.join(places)} {what}")


class _Crew:
    """The processes and their pipes; apart from the pool, so that a forgotten pool still ends them."""

    def __init__(self) -> None:
        self.processes: list[BaseProcess] = []
        self.connections: list[Connection] = []
        self.pollers: list[select.poll] = []
        """Kept, because `Connection.poll` builds one at every call."""

    def hire(self, post: Post) -> None:
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=serve, args=(there, post), name=f"hcpg-{post.worker}", daemon=True)
        with _inheritance():
            process.start()
        there.close()  # the worker holds the only other end: its death reads as the end of the pipe
        self.processes.append(process)
        self.connections.append(here)
        self.pollers.append(select.poll())
        self.pollers[-1].register(here.fileno(), select.POLLIN)

    def dismiss(self) -> None:
        for connection in self.connections:
            connection.close()
        deadline = time.monotonic() + GRACE_S
        for process in self.processes:
            process.join(max(0.0, deadline - time.monotonic()))
            process.kill()
            process.join()


@contextmanager
def _inheritance() -> Iterator[None]:
    """What a process started here keeps: single-threaded libraries, and no ear for Ctrl-C or SIGTERM.

    The parent alone decides what those signals mean; a worker ends when the parent hangs up.
    """
    before = {name: os.environ.get(name) for name in SINGLE_THREADED}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    os.environ.update(dict.fromkeys(SINGLE_THREADED, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
