"""Follow a run by the JSON lines that its journal writes, and pass its numbers on to trackers.

A follower shares nothing with the training but the folder: it may begin before, during or after it, in any
process, and whatever happens to it, the training goes on.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hcpg.loops.runs import RunFolder
from hcpg.report.rows import Row, decoded, read_rows
from hcpg.report.trackers import TRACKERS, TrackedRun, Tracker

SILENT_POLLS = 2
"""A run that nobody trains at so many looks in a row is over, whatever its status says."""
_EPISODE = ("success_once", "success_at_end", "return", "length")


class Follower:
    """Passes on what is new of one run at every `update`."""

    def __init__(self, folder: RunFolder, trackers: Sequence[str]) -> None:
        """`trackers` are names out of `TRACKERS`.

        Raises:
            MissingExtraError: the package of a tracker is not installed.
        """
        self._folder, self._names = folder, list(trackers)
        self._silent = 0
        self._begin()

    def update(self) -> None:
        """Pass on the steps that are complete: those before the newest row of metrics."""
        if any(tail.replaced() for tail in self._tails.values()):
            self._restart()  # a resume took back the rows after its checkpoint
        # In this order: what the episodes hold before the newest row of metrics is all there by then.
        metrics, episodes = self._tails["metrics"].read(), self._tails["episodes"].read()
        self._metrics += metrics
        self._episodes += episodes
        if metrics:
            self._pass_on(metrics[-1]["step"])

    def ended(self) -> bool:
        """Whether nothing more will come."""
        if self._folder.status()["state"] != "running":
            return True
        self._silent = 0 if self._folder.in_use() else self._silent + 1
        return self._silent >= SILENT_POLLS

    def close(self) -> None:
        """Pass on the rest and close the trackers."""
        self.update()
        self._pass_on(None)
        for tracker in self._trackers:
            tracker.close()

    def _begin(self) -> None:
        run = tracked_run(self._folder)
        self._trackers: list[Tracker] = [TRACKERS[name](run) for name in self._names]
        self._tails = {name: _Tail(self._folder.path / f"{name}.jsonl") for name in ("metrics", "episodes")}
        self._metrics: list[Row] = []
        self._episodes: list[Row] = []

    def _restart(self) -> None:
        for tracker in self._trackers:
            tracker.close()
        self._begin()

    def _pass_on(self, before: int | None) -> None:
        """Hand over the steps smaller than `before` (None: all) in their order."""
        ready, self._metrics = _parted(self._metrics, before)
        ready_episodes, self._episodes = _parted(self._episodes, before)
        for step, values in values_by_step(ready, ready_episodes).items():
            for tracker in self._trackers:
                tracker.log(step, values)


class _Tail:
    """The part of a growing file that was not read yet."""

    def __init__(self, path: Path) -> None:
        self._path, self._offset, self._inode = path, 0, 0

    def replaced(self) -> bool:
        """Whether what was read is there no more."""
        if self._inode == 0 or not self._path.exists():
            return False
        found = self._path.stat()
        return found.st_ino != self._inode or found.st_size < self._offset

    def read(self) -> list[Row]:
        """The complete rows since the last call."""
        if not self._path.exists():
            rows = read_rows(self._path) if self._offset == 0 else []
            self._offset = len(rows)  # of a stored, compressed run, which grows no more
            return rows
        with self._path.open("rb") as file:
            self._inode = self._path.stat().st_ino
            file.seek(self._offset)
            content = file.read()
        content = content[: content.rfind(b"\n") + 1]
        self._offset += len(content)
        return decoded(self._path, content)


def tracked_run(folder: RunFolder) -> TrackedRun:
    """What trackers are told about the run."""
    address = folder.manifest()["run"]
    return TrackedRun(
        folder.path, address["id"], address["task"], address["preset"], address["seed"], folder.config()
    )


def values_by_step(metrics: Sequence[Row], episodes: Sequence[Row]) -> dict[int, dict[str, float]]:
    """The numbers of every step, in order: `train/...`, `train_episodes/...`, `evaluation/SELECTOR/...`.

    Episodes are averaged; `steps_to_success` over those that succeeded.
    """
    found: dict[int, dict[str, float]] = defaultdict(dict)
    for row in metrics:
        found[row["step"]] |= {
            f"train/{name}": float(value)
            for name, value in row.items()
            if name != "step" and isinstance(value, int | float)
        }
    groups: dict[tuple[int, str], list[Row]] = defaultdict(list)
    for row in episodes:
        training = row["phase"] == "train"
        groups[row["step"], "train_episodes" if training else f"evaluation/{row['selector']}"].append(row)
    for (step, name), rows in groups.items():
        found[step] |= {f"{name}/{key}": value for key, value in _means(rows).items()}
    return {step: found[step] for step in sorted(found)}


def _means(rows: Sequence[Row]) -> Mapping[str, float]:
    means = {name: float(np.mean([row[name] for row in rows])) for name in _EPISODE if _known(rows, name)}
    taken = [row["steps_to_success"] for row in rows if row.get("steps_to_success", -1) >= 0]
    return means | ({"steps_to_success": float(np.mean(taken))} if taken else {})


def _known(rows: Sequence[Row], name: str) -> bool:
    """Whether every row has the number; one that was not finite is written as null."""
    return all(row.get(name) is not None for row in rows)


def _parted(rows: list[Row], before: int | None) -> tuple[list[Row], list[Row]]:
    if before is None:
        return rows, []
    return [row for row in rows if row["step"] < before], [row for row in rows if row["step"] >= before]
