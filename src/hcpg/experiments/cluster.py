"""A Ray cluster as a place for jobs. Run folders travel; no file system needs to be shared.

Every job trains in a scratch folder of its node. The launcher asks for news, writes what is new into the one
results folder, and hands it to another node if the first is lost. So only one process ever writes there, its
locks hold wherever the nodes are, and the cluster may be any.
"""

import logging
import os
import socket
from io import TextIOWrapper
from math import floor
from pathlib import Path
from typing import Any

import hcpg
from hcpg.experiments.engine import LOST
from hcpg.experiments.ledger import Entry
from hcpg.experiments.parcels import land, pack
from hcpg.experiments.station import SEND_S, News, Order, Station
from hcpg.experiments.units import Unit, command

CONNECT_S = 10.0


class ClusterError(RuntimeError):
    """A cluster that cannot do the jobs; the message says what to change."""


class RayCluster:
    """The machines of a Ray cluster; they may come and go."""

    def __init__(
        self, address: str, *, gpus_per_job: float = 0.0, cores_per_job: int = 1, send_s: float = SEND_S
    ) -> None:
        """Join the cluster at `address`.

        Raises:
            ClusterError: there is none, or none of its nodes has room for a job.
        """
        import ray

        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        try:
            _knock(address)
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
        except OSError as error:
            raise ClusterError(
                f"no Ray cluster answers at {address!r} ({error}). Start one (`ray start --head`, see "
                "docs/cluster.md) and give its HOST:6379, or auto on one of its machines."
            ) from error
        self.together = gpus_per_job > 0
        self._needs = {"CPU": float(cores_per_job), "GPU": gpus_per_job}
        self._send_s = send_s
        self._jobs: list[RayJob] = []
        if self._capacity() == 0:
            offers = "; ".join(
                f"{each.get('CPU', 0):g} cores, {each.get('GPU', 0):g} GPUs" for each in _resources()
            )
            self.close()
            raise ClusterError(
                f"no node has room for a job of {cores_per_job} cores and {gpus_per_job:g} GPUs "
                f"(--cores-per-job, --gpus-per-job). The cluster's nodes have: {offers}."
            )

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
            pack(results, unit.folders, {}),
            cores=int(self._needs["CPU"]),
            gpus=self._needs["GPU"],
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


class RayJob:
    """A unit in training somewhere in the cluster."""

    def __init__(self, order: Order, results: Path, send_s: float) -> None:
        import ray

        options: dict[str, Any] = {"num_cpus": order.cores, "num_gpus": order.gpus, "max_restarts": 0}
        self.place = "the cluster"
        self.ended = False
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
        self.place = f"node {news.node}"
        land(news.parcel, self._results)
        if news.code is not None:
            self._station.close.remote()
            self._station, self.ended = None, True  # Ray frees the place once that is carried out
            return news.code
        self._asked = self._station.news.remote()
        return None

    def stop(self, *, at_once: bool) -> None:
        """Let it save and end, or kill it."""
        self._station.stop.remote(at_once)

    def _end(self, code: int, why: str) -> int:
        """Give the job up, and note in its log what it could not write there itself."""
        import ray

        self.ended = True
        ray.kill(self._station)
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("a") as log:
            log.write(f"{why}\n")
        return code


def _knock(address: str) -> None:
    """Fail at once where nothing listens; Ray itself would wait for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if host and port.isdigit():
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()


def _resources() -> list[dict[str, float]]:
    """What each living node of the cluster offers."""
    import ray

    return [node["Resources"] for node in ray.nodes() if node["Alive"]]


def _jobs_on(node: dict[str, float], needs: dict[str, float]) -> int:
    by_cores = floor(node.get("CPU", 0.0) / needs["CPU"])
    if not needs["GPU"]:
        return by_cores
    return min(by_cores, floor(node.get("GPU", 0.0)) * floor(1 / needs["GPU"]))


def _moved(entry: Entry, results: Path) -> Entry:
    """The entry with its run folder as a path from the results folder on."""
    return entry if entry.folder is None else entry._replace(folder=entry.folder.relative_to(results))
