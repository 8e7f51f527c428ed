"""The far side of the pool: one process that steps its share of the environments.

Parent and workers share the arrays of a `Board`; the pipe carries only commands and answers. Imports nothing
heavy: a worker costs the simulator and NumPy, not JAX.
"""

import os
import threading
import traceback
from collections.abc import Callable, Mapping
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numpy as np

from hcpg import registry
from hcpg.interfaces import Environment
from hcpg.loops.memory import hand_back
from hcpg.types import Bool, Float, Int, RenderingError, UInt8

NOBODY = -1
"""Entry of `Board.busy` while a worker is inside none of its environments."""


class Sizes(NamedTuple):
    """Lengths of the board's axes."""

    environments: int
    observation: int
    action: int
    workers: int


class Board(NamedTuple):
    """The shared arrays: the parent writes `actions` and `starts`, the workers all the others."""

    observations: Float[np.ndarray, "N O"]
    next_observations: Float[np.ndarray, "N O"]
    actions: Float[np.ndarray, "N A"]
    rewards: Float[np.ndarray, " N"]
    starts: Int[np.ndarray, " N"]
    """Start state of the next reset."""
    busy: Int[np.ndarray, " W"]
    """The environment each worker is inside of, so that a crash can be laid at its door."""
    terminated: Bool[np.ndarray, " N"]
    truncated: Bool[np.ndarray, " N"]
    success: Bool[np.ndarray, " N"]


class Post(NamedTuple):
    """What a worker is told when it starts."""

    worker: int
    task: str
    seeds: Mapping[int, int]
    """Environment index -> its seed."""
    sizes: Sizes
    memory: str
    """Name of the shared memory that holds the board."""
    horizon: int
    """Steps until an episode is cut."""


def board_fields(sizes: Sizes) -> list[tuple[str, tuple[int, ...], type]]:
    """Name, shape and type of each array of the board, in the order they lie in memory."""
    each = sizes.environments
    return [
        ("starts", (each,), np.int64),
        ("busy", (sizes.workers,), np.int64),
        ("observations", (each, sizes.observation), np.float32),
        ("next_observations", (each, sizes.observation), np.float32),
        ("actions", (each, sizes.action), np.float32),
        ("rewards", (each,), np.float32),
        ("terminated", (each,), np.bool_),
        ("truncated", (each,), np.bool_),
        ("success", (each,), np.bool_),
    ]


def board_bytes(sizes: Sizes) -> int:
    """How much memory a board takes, bytes."""
    return sum(int(np.prod(shape)) * np.dtype(kind).itemsize for _, shape, kind in board_fields(sizes))


def board_in(memory: SharedMemory, sizes: Sizes) -> Board:
    """The board that lies in `memory`; the widest types come first, so every array is aligned."""
    arrays, offset = {}, 0
    for name, shape, kind in board_fields(sizes):
        arrays[name] = np.ndarray(shape, kind, memory.buf, offset)
        offset += arrays[name].nbytes
    return Board(**arrays)


class Station:
    """Some environments and their episode clocks, working on a board."""

    def __init__(
        self, environments: Mapping[int, Environment], horizon: int, board: Board, worker: int = 0
    ) -> None:
        self._environments, self._horizon, self._board, self._worker = environments, horizon, board, worker
        self._ages = dict.fromkeys(environments, 0)

    def reset(self) -> None:
        """Begin an episode in every environment, from the board's start states."""
        for index in self._environments:
            self._board.busy[self._worker] = index
            self._begin(index)
        self._board.busy[self._worker] = NOBODY

    def step(self) -> None:
        """Carry out the board's actions; an episode that ends is followed by the next one at once."""
        for index in self._environments:
            self._board.busy[self._worker] = index
            self._step(index)
        self._board.busy[self._worker] = NOBODY

    def restore(self, actions: Mapping[int, Float[np.ndarray, "_ A"]]) -> None:
        """Begin an episode in every environment and repeat the given actions.

        Raises:
            ValueError: the actions reach the end of the episode, so they cannot be those of a running one.
        """
        self.reset()
        for index, replayed in actions.items():
            self._board.busy[self._worker] = index
            if len(replayed) >= self._horizon:
                raise ValueError(
                    f"environment {index}: cannot continue after {len(replayed)} actions, because an episode "
                    f"has {self._horizon}; give only the actions since the episode's start"
                )
            for action in replayed:
                self._board.actions[index] = action
                self._step(index)
            if self._ages[index] != len(replayed):
                raise ValueError(
                    f"environment {index}: the episode ended within the {len(replayed)} replayed actions; "
                    "start state and actions do not belong together"
                )
        self._board.busy[self._worker] = NOBODY

    def render(self, index: int) -> UInt8[np.ndarray, "H W 3"]:
        """The picture of one environment."""
        self._board.busy[self._worker] = index
        picture = self._environments[index].render()
        self._board.busy[self._worker] = NOBODY
        return picture

    def close(self) -> None:
        """Free the simulators."""
        for environment in self._environments.values():
            environment.close()

    def _begin(self, index: int) -> None:
        self._board.observations[index] = self._environments[index].reset(int(self._board.starts[index]))
        self._ages[index] = 0

    def _step(self, index: int) -> None:
        board = self._board
        observation, reward, terminated, success = self._environments[index].step(board.actions[index].copy())
        self._ages[index] += 1
        truncated = self._ages[index] == self._horizon and not terminated
        board.next_observations[index] = observation
        board.observations[index] = observation
        board.rewards[index] = reward
        board.terminated[index], board.truncated[index] = terminated, truncated
        board.success[index] = success
        if terminated or truncated:
            self._begin(index)


def serve(connection: Connection, post: Post) -> None:
    """Answer the parent's commands until it hangs up; the body of a worker process.

    A command is `(method of the station, arguments)`; an answer is `(None, result)`, or `(failure, None)`
    when the simulator raised an error: `Board.busy` then names the environment, and the worker ends. A
    failure is a traceback, or the error itself where the machine is to blame and no line of code is.
    """
    threading.Thread(target=_leave_with_parent, daemon=True).start()
    memory = SharedMemory(post.memory)
    board = board_in(memory, post.sizes)
    try:
        _answer_commands(connection, post, board)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass  # the parent hung up, or is gone: nobody is left to tell
    finally:
        del board
        memory.close()


def _answer_commands(connection: Connection, post: Post, board: Board) -> None:
    failure, station = _attempt(_open_station, post, board)
    connection.send((failure, None))
    try:
        while failure is None:
            name, arguments = connection.recv()
            failure, result = _attempt(getattr(station, name), *arguments)
            connection.send((failure, result))
    finally:
        if station is not None:
            station.close()


def _attempt(call: Callable[..., Any], *arguments: Any) -> tuple[str | RenderingError | None, Any]:
    try:
        return None, call(*arguments)
    except RenderingError as error:
        return error, None
    except Exception:  # whatever a simulator raises is the parent's to report
        return traceback.format_exc(), None


def _open_station(post: Post, board: Board) -> Station:
    task = registry.task(post.task)
    suite = registry.suite(task.suite)
    environments = {}
    for index, seed in post.seeds.items():
        board.busy[post.worker] = index
        environments[index] = suite.make(task, seed)
    board.busy[post.worker] = NOBODY
    hand_back()  # what reading the models left
    return Station(environments, post.horizon, board, post.worker)


def _leave_with_parent() -> None:
    """End this process when the parent ends, also while a simulator hangs."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
