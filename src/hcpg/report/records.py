"""Run folders as arrays: evaluations by step and selector, seeds of one preset on one task side by side."""

import json
import logging
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.report.durations import undisturbed_s
from hcpg.report.episodes import Episodes
from hcpg.report.measured import BARE, Curve, Measured, RecordError, measure
from hcpg.report.reading import measured_runs
from hcpg.report.rows import RowError, read_rows

PARTS = ("manifest", "config", "status")
"""The JSON files of a run folder."""
_LOG = logging.getLogger(__name__)


class Record(NamedTuple):
    """What one run (one seed) showed."""

    path: Path
    task: str
    preset: str
    seed: int
    adapter: str
    """How the scene was read; results of different adapters do not belong into one comparison."""
    selector: str
    """The selector the run was evaluated with (beside `bare`)."""
    curves: Mapping[str, Curve]
    """By selector."""
    episodes: Mapping[str, Episodes]
    """The same, episode by episode."""
    config: Mapping[str, Any]
    """The resolved settings; runs with equal ones share the object, so it is not to be changed."""
    manifest: Mapping[str, Any]
    """Where the run comes from; parts that are equal in several runs are one object, too."""
    status: Mapping[str, Any]
    wall_s: float
    """Time of the training so far; NaN without metrics."""

    @property
    def name(self) -> str:
        """The run in a few words."""
        return f"{self.preset} on {self.task} s{self.seed}"

    @property
    def steps_per_s(self) -> float:
        """Median rate of environment steps, read from the metrics; NaN without them.

        Raises:
            RowError: a line of the metrics is damaged.
        """
        rows = read_rows(self.path / "metrics.jsonl")
        speeds = [row["steps_per_s"] for row in rows if row["steps_per_s"] is not None]
        return float(np.median(speeds)) if speeds else float("nan")

    @property
    def undisturbed_s(self) -> float:
        """Time that the run takes where nothing suspends it, evaluations included; NaN without metrics.

        Raises:
            RowError: a line of the metrics is damaged.
        """
        evaluated = {step for curve in self.curves.values() for step in curve.steps.tolist()}
        return undisturbed_s(read_rows(self.path / "metrics.jsonl"), evaluated)


class Group(NamedTuple):
    """The seeds of one preset on one task."""

    task: str
    preset: str
    runs: tuple[Record, ...]

    def curve(self, selector: str) -> Curve | None:
        """Seeds as rows, at the steps all were evaluated at; None if one never was with this selector."""
        curves = [run.curves[selector] for run in self.runs if selector in run.curves]
        if len(curves) < len(self.runs):
            return None
        curves = _at_common_steps(curves)
        successes, episodes = (
            np.stack(counts) for counts in zip(*(curve[1:] for curve in curves), strict=True)
        )
        return Curve(curves[0].steps, successes, episodes)

    @property
    def selector(self) -> str:
        """The selector that the preset was evaluated with."""
        return self.runs[0].selector


def _at_common_steps(curves: Sequence[Curve]) -> Sequence[Curve]:
    """Each curve at the steps that all have."""
    if all(np.array_equal(curve.steps, curves[0].steps) for curve in curves):
        return curves
    steps = sorted(set.intersection(*(set(curve.steps.tolist()) for curve in curves)))
    places = [np.isin(curve.steps, steps) for curve in curves]
    return [Curve(*(counts[place] for counts in curve)) for curve, place in zip(curves, places, strict=True)]


def find_runs(root: Path) -> list[Path]:
    """The run folders at or under `root`, oldest first."""
    found = []
    for folder, inner, files in os.walk(root):
        if "manifest.json" in files:
            inner.clear()
            found.append(Path(folder))
    # A name that begins with a dot belongs to a folder that was still being made when its process died.
    return sorted((run for run in found if not run.name.startswith(".")), key=lambda run: run.name)


def load_runs(roots: Iterable[Path], skip_corrupt: bool = False) -> list[Group]:
    """All runs at or under `roots`, grouped by task and preset; of each seed the newest run.

    Runs without an evaluation and older runs of a seed are left out, with a notice; so are runs that cannot
    be read, if `skip_corrupt`.

    Raises:
        RecordError: nothing is left, the rows of a run contradict each other, or a file of it is damaged.
    """
    newest: dict[tuple[str, str, int], Record] = {}
    paths = {path for root in roots for path in find_runs(root)}
    for record in _readable(sorted(paths, key=lambda path: path.name), skip_corrupt):
        place = (record.task, record.preset, record.seed)
        if not record.curves:
            _LOG.warning("left out %s: it has no evaluation yet", record.path)
            continue
        if place in newest:
            _LOG.warning("left out %s: %s is a newer run of that seed", newest[place].path, record.path)
        newest[place] = record
    if not newest:
        raise RecordError(
            f"no evaluated run under {', '.join(map(str, roots))}. Train up to an evaluation first."
        )
    members: dict[tuple[str, str], list[Record]] = {}
    for key in sorted(newest):
        members.setdefault(key[:2], []).append(newest[key])
    return [Group(*pair, tuple(runs)) for pair, runs in members.items()]


def _readable(paths: Iterable[Path], skip_corrupt: bool) -> Iterator[Record]:
    for path, measured in measured_runs(paths):
        try:
            if isinstance(measured, Exception):
                raise measured
            yield load_run(path, measured)
        except (RecordError, RowError) as error:
            if not skip_corrupt:
                raise RecordError(f"{error} Or leave the run out with --skip-corrupt.") from error
            _LOG.warning("skipped a corrupt run: %s", error)


def json_object(path: Path) -> dict[str, Any]:
    """What a JSON file of a run folder holds; files with equal text share the object.

    Raises:
        RecordError: the file is missing, or is no JSON object.
    """
    try:
        found = _parsed(path.read_text())
    except FileNotFoundError as error:
        raise RecordError(f"there is no {path}. Restore it, or remove the rest of that run.") from error
    except ValueError as error:
        raise RecordError(f"{path} is damaged ({error}). Restore it.") from error
    if not isinstance(found, dict):
        raise RecordError(f"{path} holds no JSON object. Restore it.")
    return found


_parsed = lru_cache(maxsize=256)(json.loads)


def load_run(path: Path, measured: Measured | None = None) -> Record:
    """One run folder; its curves are empty before the first evaluation.

    What was measured is read here unless it is given.

    Raises:
        RecordError: an evaluation counts a start state twice, or mixes adapters; or one of the folder's JSON
            files is damaged.
        RowError: a line of its tables is damaged.
    """
    manifest, config, status = (json_object(path / f"{name}.json") for name in PARTS)
    address = manifest.get("run")
    if not isinstance(address, dict) or not {"task", "preset", "seed"} <= address.keys():
        raise RecordError(f"{path / 'manifest.json'} does not say task, preset and seed. Restore it.")
    shown = measured or measure(path)
    return Record(
        path=path,
        task=address["task"],
        preset=address["preset"],
        seed=address["seed"],
        adapter=shown.adapter,
        selector=next((name for name in shown.episodes if name != BARE), BARE),
        curves=shown.curves,
        episodes=shown.episodes,
        config=config,
        manifest={key: _parsed(json.dumps(part)) for key, part in manifest.items()},
        status=status,
        wall_s=shown.wall_s,
    )
