"""The far end of a cluster's job: trains in a scratch folder of its node and hands out what is new in it."""

import os
import platform
import shutil
import tempfile
import time
from io import TextIOWrapper
from pathlib import Path
from typing import NamedTuple

import hcpg
from hcpg.experiments.claims import is_locked, locked
from hcpg.experiments.local import stop, training
from hcpg.experiments.parcels import Parcel, Stamp, land, pack
from hcpg.experiments.slots import Slot, core_slots, jobs_per_card, own_folder
from hcpg.loops import machine
from hcpg.report.records import find_runs

SEND_S = 30.0
"""How often tables and logs are sent while no checkpoint is new."""
LEFT_BEHIND_S = 60.0
"""Age from which a scratch folder that nobody holds is what a killed job has left."""
LOCK = "lock"


class StationError(RuntimeError):
    """A node that cannot do the job; the message says what to mend."""


class Needs(NamedTuple):
    """What a job takes of its node."""

    cores: int
    gpus: float
    """Share of a card; 0 for training on cores."""


class Order(NamedTuple):
    """What a station shall do."""

    version: str
    """Of the launcher's hcpg."""
    words: list[str]
    """The arguments of `hcpg`, with paths from the results folder on."""
    log: Path
    """Where the output goes, likewise."""
    parcel: Parcel
    """The run folders to go on in, if any."""
    needs: Needs


class News(NamedTuple):
    """What a station has to say."""

    node: str
    code: int | None
    """The exit code of the training; None while it runs."""
    parcel: Parcel


class Station:
    """One job on one node; its scratch folder goes with it, or is swept by a later one if it was killed."""

    def __init__(self, send_s: float = SEND_S) -> None:
        self._send_s = send_s
        self._locks: list[TextIOWrapper] = []
        self._sent: dict[str, Stamp] = {}

    def start(self, order: Order) -> News:
        """Begin to train.

        Raises:
            StationError: the node has another version of hcpg.
        """
        if order.version != hcpg.__version__:
            raise StationError(
                f"node {platform.node()} has hcpg {hcpg.__version__}, the launcher {order.version}. "
                "Install one version on all nodes."
            )
        self._root = self._scratch_folder()
        self._root.mkdir()
        land(order.parcel, self._root)
        self._log = self._root / order.log
        self._pack()  # what came from the launcher, it has
        self._process = training(
            order.words,
            self._log,
            self._slot(order.needs),
            keep=self._locks,
            folder=self._root,
            leash=True,
        )
        return self.news()

    def news(self) -> News:
        """What is new since the last call: a checkpoint at once, all else every `send_s` seconds."""
        code = self._process.poll()  # first: what it wrote last is then there to be sent
        packed_at, packed = self._packed
        is_due = self._checkpoints() != packed or time.monotonic() > packed_at + self._send_s
        if code is None and not is_due:
            return News(platform.node(), None, Parcel({}, {}))
        return News(platform.node(), code, self._pack())

    def stop(self) -> None:
        """Let the training save and end."""
        stop(self._process, at_once=False)

    def close(self) -> None:
        """Delete the scratch folder, once the training has ended."""
        shutil.rmtree(self._root.parent)
        for lock in self._locks:
            lock.close()

    def _scratch_folder(self) -> Path:
        """A new folder of this job's, after sweeping out those of jobs that were killed."""
        jobs = own_folder() / "jobs"
        jobs.mkdir(parents=True, exist_ok=True)
        sweep(jobs)
        folder = Path(tempfile.mkdtemp(dir=jobs))
        lock = locked(folder / LOCK)
        assert lock is not None, "the folder is new, so nobody can hold its lock"
        self._locks.append(lock)
        return folder / "results"

    def _slot(self, needs: Needs) -> Slot:
        """Cores of this node that no other job has; left to the scheduler if there are not enough."""
        cores: set[int] = set()
        for each in core_slots(sorted(os.sched_getaffinity(0))):
            if len(cores) < needs.cores and (lock := each.take()) is not None:
                self._locks.append(lock)
                cores |= each.cores
        variables = {"JAX_PLATFORMS": "cpu"}
        if needs.gpus:
            variables = machine.gpu_share(os.environ, jobs_per_card(needs.gpus))
        return Slot("node", frozenset(cores if len(cores) == needs.cores else ()), variables)

    def _pack(self) -> Parcel:
        self._packed = time.monotonic(), self._checkpoints()
        return pack(self._root, find_runs(self._root), [self._log], self._sent)

    def _checkpoints(self) -> set[Path]:
        return checkpoints(self._root)


def checkpoints(root: Path) -> set[Path]:
    """Those of the runs under `root`, while a trainer makes and deletes folders there.

    `rglob` would look into a folder half-written or half-deleted, and fail when it vanishes meanwhile.
    """
    return {path for run in find_runs(root) for path in (run / "checkpoints").glob("step_*")}


def sweep(jobs: Path) -> None:
    """Delete the scratch folders that no living process holds."""
    for folder in jobs.iterdir():
        if folder.stat().st_mtime < time.time() - LEFT_BEHIND_S and not is_locked(folder / LOCK):
            shutil.rmtree(folder)
