"""The tables of many runs, read by as many processes as are worth it.

A report of ten thousand runs spends half its time on their tables. What a process reads is its own: it hands
back arrays, errors and notices, and the caller goes through them as if it had read the tables itself.
"""

import logging
import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from hcpg.report.measured import Measured, RecordError, measure
from hcpg.report.notices import kept
from hcpg.report.rows import RowError

WORTH_A_PROCESS = 1000
"""Runs that take as long to read as a process takes to start, several times over."""
AT_ONCE = 100
"""Runs that go to a process together."""
_LOG = logging.getLogger(__name__)

Outcome = Measured | RecordError | RowError


class _Read(NamedTuple):
    outcomes: list[Outcome]
    notices: list[str]


def measured_runs(paths: Iterable[Path]) -> Iterator[tuple[Path, Outcome]]:
    """Each run folder with what it showed, in the order given, or with the error that reading it raises."""
    paths = list(paths)
    processes = min(len(os.sched_getaffinity(0)), len(paths) // WORTH_A_PROCESS)
    if processes < 2:
        yield from ((path, _outcome(path)) for path in paths)
        return
    with ProcessPoolExecutor(processes, get_context("spawn")) as crew:
        parts = [paths[first : first + AT_ONCE] for first in range(0, len(paths), AT_ONCE)]
        for part, read in zip(parts, crew.map(_read, parts), strict=True):
            for notice in read.notices:
                _LOG.warning("%s", notice)
            yield from zip(part, read.outcomes, strict=True)


def _read(paths: Sequence[Path]) -> _Read:
    with kept() as notices:
        outcomes = [_outcome(path) for path in paths]
    return _Read(outcomes, notices)


def _outcome(path: Path) -> Outcome:
    try:
        return measure(path)
    except (RecordError, RowError) as error:
        return error
