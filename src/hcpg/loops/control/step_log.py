"""Every step on the disk as one JSON line, without the loop ever waiting for the disk, and none ever lost.

A thread writes. Where the disk is full, room set aside at the start is given back, what waits is written into
it, and `failure` says so: the loop stops at its next tick. No step is dropped, and none is written twice.
"""

import errno
import json
import math
import os
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

RESERVE_BYTES = 1 << 20
"""Room set aside: about a hundred steps of the largest kind."""
MOST_WAITING = 300
"""Steps that may wait for the disk before the loop has to stop: ten seconds at 30 Hz."""
_PAUSE_S = 0.05


class LogError(RuntimeError):
    """Steps that are not on the disk; the message says how many, why, and where there is room needed."""


@runtime_checkable
class Sink(Protocol):
    """Where bytes go; what an unbuffered file offers."""

    def write(self, content: bytes, /) -> int | None:
        """How many of the bytes were taken."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


def _opened(path: Path) -> Sink:
    return path.open("ab", buffering=0)


class StepLog:
    """Appends rows to `path`."""

    def __init__(
        self, path: Path, open_sink: Callable[[Path], Sink] = _opened, threaded: bool = True
    ) -> None:
        """Without `threaded`, `put` writes at once: for clocks that stand still meanwhile.

        Raises:
            LogError: there is not even room for the reserve.
        """
        self.path = path
        self.failure = ""
        """Why rows could not be written; "" while all is well, and never again after."""
        self._rows: deque[Mapping[str, Any]] = deque()
        self._unsent = b""
        self._writing = threading.Lock()
        self._wanted, self._closed = threading.Event(), False
        self._reserve = path.with_name(f".{path.name}.reserve")
        self._set_aside()
        self._sink = open_sink(path)
        self._thread: threading.Thread | None = None
        if threaded:
            self._thread = threading.Thread(target=self._serve, name="step log", daemon=True)
            self._thread.start()

    def put(self, row: Mapping[str, Any]) -> None:
        """Have `row` written, later; what is not finite becomes null, a named tuple an object."""
        self._rows.append(row)
        if len(self._rows) > MOST_WAITING:
            self.failure = self.failure or f"{len(self._rows)} steps wait for the disk; it is too slow"
        if self._thread is None:
            self.write_waiting()
        self._wanted.set()

    def write_waiting(self) -> bool:
        """Write what waits; gives whether nothing waits any more."""
        with self._writing:
            while self._rows:
                self._unsent += _line(self._rows[0])
                self._rows.popleft()
            return self._sent() or (self._reserve_given_back() and self._sent())

    def close(self) -> None:
        """Write the rest and let go of the file; safe to call twice.

        Raises:
            LogError: rows could not be written even into the reserve.
        """
        if self._closed:
            return
        self._closed = True
        self._wanted.set()
        if self._thread is not None:
            self._thread.join()
        complete = self.write_waiting()
        self._sink.close()
        self._reserve.unlink(missing_ok=True)
        if not complete:
            lost = self._unsent.count(b"\n")
            raise LogError(f"{lost} steps are not in {self.path} ({self.failure}); make room first next time")

    def _sent(self) -> bool:
        """Whether all bytes were taken; what was not taken stays, to the byte."""
        while self._unsent:
            try:
                taken = self._sink.write(self._unsent)
            except OSError as error:
                self.failure = self.failure or f"cannot write {self.path.name}: {error.strerror}"
                self._full = error.errno in (errno.ENOSPC, errno.EDQUOT)
                return False
            self._unsent = self._unsent[taken or 0 :]
        return True

    def _reserve_given_back(self) -> bool:
        """Free the reserve; gives whether it was there, so that another try makes sense."""
        if not self._full or not self._reserve.exists():
            return False
        self._reserve.unlink()
        return True

    def _set_aside(self) -> None:
        self._full = False
        try:
            with self._reserve.open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, RESERVE_BYTES)
        except OSError as error:
            self._reserve.unlink(missing_ok=True)
            raise LogError(f"no room for the log of the steps, {self.path}: {error.strerror}") from error

    def _serve(self) -> None:
        while not self._closed:
            self._wanted.wait(_PAUSE_S if self._rows else None)
            self._wanted.clear()
            self.write_waiting()


def plain(value: Any) -> Any:
    """`value` as JSON can hold it; of what it has no word for, the text that Python prints."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (int, str)) or value is None:
        return value
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain_array(np.asarray(value))
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if hasattr(value, "_asdict"):
        return {name: plain(each) for name, each in value._asdict().items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return repr(value)


def _plain_array(array: np.ndarray) -> Any:
    is_number = array.dtype.kind in "biuf"
    return array.tolist() if is_number and np.isfinite(array).all() else plain(array.tolist())


def _line(row: Mapping[str, Any]) -> bytes:
    return json.dumps(plain(row), allow_nan=False, separators=(",", ":")).encode() + b"\n"
