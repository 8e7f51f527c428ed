"""A Ray cluster as a place for jobs. Run folders travel; no file system needs to be shared.

Every job trains in a scratch folder of its node. The launcher asks for news, writes what is new into the one
results folder, and hands it to another node if the first is lost. So only one process ever writes there, its
locks hold wherever the nodes are, and the cluster may be any.
"""

import logging
import os
import socket
import time
from io import TextIOWrapper
from math import floor
from pathlib import Path
from typing import Any

import hcpg
from hcpg.experiments.engine import LOST
from hcpg.experiments.ledger import Entry
from hcpg.experiments.parcels import land, pack
from hcpg.experiments.slots import jobs_per_card
from hcpg.experiments.station import SEND_S, Needs, News, Order, Station
from hcpg.experiments.units import Unit, command

PATIENCE_S = 60.0
"""How long a cluster may take to come up before it counts as absent."""
PAUSE_S = 0.5


class ClusterError(RuntimeError):
    """A cluster that cannot do the jobs; the message says what to change."""


class RayCluster:
    """The machines of a Ray cluster; they may come and go."""

    def __init__(
        self, address: str, needs: Needs, *, send_s: float = SEND_S, patience_s: float = PATIENCE_S
    ) -> None:
        """Join the cluster at `address`; wait for it, and for a node with room for one job, if need be.

        Raises:
            ClusterError: after `patience_s` there is none.
        """
        deadline = time.monotonic() + patience_s
        _join(address, deadline)
        self.together = needs.gpus > 0
        self._needs, self._send_s = needs, send_s
        self._jobs: list[RayJob] = []
        while self._capacity() == 0:
            if time.monotonic() > deadline:
                raise self._no_room()
            time.sleep(PAUSE_S)

    def room(self) -> bool:
        """Whether the nodes that are alive could hold one more job of this launch."""
        self._jobs = [job for job in self._jobs if not job.ended]
        return len(self._jobs) < self._capacity()

    def start(self, unit: Unit, results: Path, claims: list[TextIOWrapper]) -> "RayJob":
        """Train the unit on the node that Ray chooses; should this process die, Ray ends the job."""
        del claims  # this process holds them
        moved = Unit(tuple(_moved(entry, results) for entry in unit.entries))
        order = Order(
            hcpg.__version__,
            command(moved, Path()),
            unit.log,
            pack(results, unit.folders, [results / unit.log], {}),
            self._needs,
        )
        job = RayJob(order, results, self._send_s)
        self._jobs.append(job)
        return job

    def close(self) -> None:
        """Leave the cluster, which ends what still runs there."""
        import ray

        ray.shutdown()

    def _capacity(self) -> int:
        """Jobs that the living nodes can hold at once."""
        return sum(_jobs_on(node, self._needs) for node in _resources())

    def _no_room(self) -> ClusterError:
        """Leave, and say what was asked for and what there is."""
        offers = [f"{each.get('CPU', 0):g} cores and {each.get('GPU', 0):g} GPUs" for each in _resources()]
        self.close()
        return ClusterError(
            f"no node has room for a job of {self._needs.cores} cores and {self._needs.gpus:g} GPUs "
            f"(--cores-per-job, --gpus-per-job). The cluster's nodes have: {'; '.join(offers)}."
        )


class RayJob:
    """A unit in training somewhere in the cluster."""

    def __init__(self, order: Order, results: Path, send_s: float) -> None:
        import ray

        cores, gpus = order.needs
        options: dict[str, Any] = {"num_cpus": cores, "num_gpus": gpus, "max_restarts": 0}
        self.place = "the cluster"
        self.ended = self._begun = False
        self._results, self._log = results, results / order.log
        self._station: Any = ray.remote(**options)(Station).remote(send_s)
        self._asked = self._station.start.remote(order)

    def poll(self) -> int | None:
        """The exit code, or `LOST`; None while it runs. What is new is then in the results folder."""
        import ray
        from ray.exceptions import ObjectLostError, OutOfMemoryError, RayActorError, RayTaskError

        if not ray.wait([self._asked], timeout=0)[0]:
            return None
        try:
            news: News = ray.get(self._asked)
        except (RayActorError, ObjectLostError, OutOfMemoryError) as error:
            return self._end(LOST, str(error))
        except RayTaskError as error:  # the station says what is wrong with its node
            return self._end(1, str(error))
        self.place, self._begun = f"node {news.node}", True
        land(news.parcel, self._results)
        if news.code is not None:
            self._station.close.remote()
            self._station, self.ended = None, True  # Ray frees the place once that is carried out
            return news.code
        self._asked = self._station.news.remote()
        return None

    def stop(self, *, at_once: bool) -> None:
        """Let it save and end; or kill it, which is also the end of one that has not begun."""
        import ray

        if at_once or not self._begun:
            ray.kill(self._station)
        else:
            self._station.stop.remote()

    def _end(self, code: int, why: str) -> int:
        """Give the job up, and note in its log what it could not write there itself."""
        import ray

        self.ended = True
        ray.kill(self._station)
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("a") as log:
            log.write(f"{why}\n")
        return code


def _join(address: str, deadline: float) -> None:
    """Connect this process to the cluster, as soon as it is there."""
    import ray

    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    while True:
        try:
            _knock(address)
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
            return
        except OSError as error:
            if time.monotonic() > deadline:
                raise ClusterError(
                    f"no Ray cluster answers at {address!r} ({error}). Start one (`ray start --head`, see "
                    "docs/cluster.md) and give its HOST:PORT, or auto on one of its machines."
                ) from error
        time.sleep(PAUSE_S)


def _knock(address: str) -> None:
    """Fail at once where nobody listens at HOST:PORT; Ray itself would wait for minutes."""
    host, _, port = address.rpartition(":")
    if host and port.isdigit():
        socket.create_connection((host, int(port)), timeout=PATIENCE_S).close()


def _resources() -> list[dict[str, float]]:
    """What each living node of the cluster offers."""
    import ray

    return [node["Resources"] for node in ray.nodes() if node["Alive"]]


def _jobs_on(node: dict[str, float], needs: Needs) -> int:
    by_cores = floor(node.get("CPU", 0.0) / needs.cores)
    if not needs.gpus:
        return by_cores
    return min(by_cores, floor(node.get("GPU", 0.0)) * jobs_per_card(needs.gpus))


def _moved(entry: Entry, results: Path) -> Entry:
    """The entry with its run folder as a path from the results folder on."""
    return entry if entry.folder is None else entry._replace(folder=entry.folder.relative_to(results))
