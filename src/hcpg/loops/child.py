"""The body of a process that trains the runs of one job, and what it tells its parent.

The parent may vanish at any moment: the pipe's end then counts as a request to stop, and the state is saved.
"""

import os
import sys
import threading
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.loops.compiled_programs import CompiledPrograms, open_programs
from hcpg.loops.stops import obey_parent

STOP = "stop"


class Job(NamedTuple):
    """Runs of one configuration that share a process."""

    config: dict[str, Any]
    """`Settings.as_json()`: plain values, which a process can be handed before it imports JAX."""
    seeds: list[int]
    root: Path
    """Where new run folders go."""
    folders: list[Path]
    """The folders of runs to be taken up again, one per seed; none for new runs."""


class Message(NamedTuple):
    """What a child tells: news of the run with that seed."""

    kind: str
    """An event's kind, or `opened` (its folder is there), or `failed`."""
    seed: int
    facts: dict[str, Any]


def work(job: Job, workers: int, log: Path, pipe: Connection) -> None:
    """Train the job's runs; every message goes through the pipe, every other output into the log.

    JAX is imported once the environment variables are in place.
    """
    redirect_output(log)
    programs = open_programs(os.environ)
    talk = _Talk(pipe, programs)
    obey_parent(talk.stop.set)
    try:
        _train(job, workers, log, talk)
    except Exception as error:  # whatever it is, the parent reports it; the traceback stays in the log
        traceback.print_exc()
        for seed in job.seeds:
            talk.tell(Message("failed", seed, {"error": as_text(error)}))
        sys.exit(1)
    finally:
        if programs is not None:
            programs.close()


def _train(job: Job, workers: int, log: Path, talk: "_Talk") -> None:
    from hcpg import presets
    from hcpg.loops.runs import RunFolder
    from hcpg.loops.sitting import create_folders, sit

    settings = presets.from_json(job.config)
    if job.folders:
        folders = [RunFolder.open(path) for path in job.folders]
    else:
        folders = create_folders(settings, job.seeds, job.root)
        log.rename(log_of(folders[0].path))
    for seed, folder in zip(job.seeds, folders, strict=True):
        talk.tell(Message("opened", seed, {"folder": str(folder.path)}))
    sit(settings, folders, workers, lambda event: talk.tell(Message(*event)), talk.stop.is_set)


def log_of(folder: Path) -> Path:
    """Where the output of the process that trains a run goes; of several runs, the first one's."""
    return folder / "log.txt"


class _Talk:
    """The child's end of the pipe."""

    def __init__(self, pipe: Connection, programs: CompiledPrograms | None) -> None:
        self.stop = threading.Event()
        self._pipe, self._programs = pipe, programs
        threading.Thread(target=self._listen, daemon=True).start()

    def tell(self, message: Message) -> None:
        if message.kind == "evaluation" and self._programs is not None:
            self._programs.publish()  # by now everything is compiled
        try:
            self._pipe.send(message)
        except (BrokenPipeError, ConnectionResetError):
            self.stop.set()  # nobody listens any more

    def _listen(self) -> None:
        with suppress(EOFError, ConnectionResetError):  # the parent is gone, which means the same
            self._pipe.recv()  # the only thing ever sent this way is STOP
        self.stop.set()


def redirect_output(log: Path) -> None:
    """Send all output of this process, also what XLA writes from C++, into the file `log`."""
    log.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    for standard in (1, 2):
        os.dup2(descriptor, standard)
    os.close(descriptor)


def as_text(error: Exception) -> str:
    """An error in words: our own speak for themselves, another one needs its type."""
    ours = type(error).__module__.startswith("hcpg.")
    return str(error) if ours else f"{type(error).__name__}: {error}"
