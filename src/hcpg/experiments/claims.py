"""Who is at work: locks on cells, cores and cards that the kernel lifts when their holders are gone."""

import fcntl
import hashlib
import os
from io import TextIOWrapper
from pathlib import Path

from hcpg.experiments.protocols import Cell

FOLDER = ".claims"


def locked(path: Path) -> TextIOWrapper | None:
    """The file at `path`, open and locked; None if somebody else holds it.

    The lock lasts until every process that has the file open has closed it or died. A process started with
    the file among its `pass_fds` keeps it beyond the death of its starter.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.open("a")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        return None
    return file


def is_locked(path: Path) -> bool:
    """Whether a living process holds the file at `path`."""
    if not path.exists():
        return False
    # Shared, so that those who only ask never stand in each other's way or in the way of an answer.
    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def claim_of(cell: Cell, results: Path) -> Path:
    """The file whose lock says that somebody trains the cell for this results folder."""
    return results / FOLDER / hashlib.sha256(repr(cell.identity()).encode()).hexdigest()
