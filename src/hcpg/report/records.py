"""Run folders as arrays: evaluations by step and selector, seeds of one preset on one task side by side."""

import json
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.report.rows import Row, read_rows
from hcpg.types import Float, Int

BARE = "bare"
"""The selector name under which a method's own action, without any selector, is recorded."""
_LOG = logging.getLogger(__name__)


class RecordError(ValueError):
    """Rows that no honest number can be made of; the message says which and why."""


class Curve(NamedTuple):
    """The evaluations of one run with one selector, in the order of training."""

    steps: Int[np.ndarray, " T"]
    """Environment steps of training when evaluated."""
    successes: Int[np.ndarray, "*seeds T"]
    """Episodes with `success_once`."""
    episodes: Int[np.ndarray, "*seeds T"]
    """Episodes evaluated."""

    @property
    def rates(self) -> Float[np.ndarray, "*seeds T"]:
        """Success rates in [0, 1]."""
        return self.successes / self.episodes


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
    status: Mapping[str, Any]
    steps_per_s: float
    """Median rate of environment steps; NaN without metrics."""
    wall_s: float
    """Time of the training so far; NaN without metrics."""


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
        steps = sorted(set.intersection(*(set(curve.steps.tolist()) for curve in curves)))
        places = [np.isin(curve.steps, steps) for curve in curves]
        successes = [curve.successes[place] for curve, place in zip(curves, places, strict=True)]
        episodes = [curve.episodes[place] for curve, place in zip(curves, places, strict=True)]
        return Curve(np.array(steps, dtype=int), np.stack(successes), np.stack(episodes))

    @property
    def selector(self) -> str:
        """The selector that the preset was evaluated with."""
        return self.runs[0].selector


def find_runs(root: Path) -> list[Path]:
    """The run folders at or under `root`, oldest first."""
    found = [file.parent for file in root.rglob("manifest.json")]
    # A name that begins with a dot belongs to a folder that was still being made when its process died.
    return sorted((run for run in found if not run.name.startswith(".")), key=lambda run: run.name)


def load_runs(roots: Iterable[Path]) -> list[Group]:
    """All runs at or under `roots`, grouped by task and preset; of each seed the newest run.

    Runs without an evaluation and older runs of a seed are left out, with a notice.

    Raises:
        RecordError: nothing is left, or the rows of a run contradict each other.
    """
    newest: dict[tuple[str, str, int], Record] = {}
    paths = {path for root in roots for path in find_runs(root)}
    for path in sorted(paths, key=lambda path: path.name):
        record = load_run(path)
        place = (record.task, record.preset, record.seed)
        if not record.curves:
            _LOG.warning("left out %s: it has no evaluation yet", path)
            continue
        if place in newest:
            _LOG.warning("left out %s: %s is a newer run of that seed", newest[place].path, path)
        newest[place] = record
    if not newest:
        raise RecordError(
            f"no evaluated run under {', '.join(map(str, roots))}. Train up to an evaluation first."
        )
    pairs = sorted({place[:2] for place in newest})
    return [Group(*pair, tuple(newest[key] for key in sorted(newest) if key[:2] == pair)) for pair in pairs]


def load_run(path: Path) -> Record:
    """One run folder; its curves are empty before the first evaluation.

    Raises:
        RecordError: an evaluation counts a start state twice, or mixes adapters.
        RowError: a line of its tables is damaged.
    """
    address = json.loads((path / "manifest.json").read_text())["run"]
    rows = [row for row in read_rows(path / "episodes.jsonl") if row["phase"] == "evaluation"]
    adapters = {row["adapter"] for row in rows}
    if len(adapters) > 1:
        raise RecordError(
            f"{path}: evaluations mix the adapters {', '.join(sorted(adapters))}; report one of them."
        )
    selectors = list(dict.fromkeys(row["selector"] for row in rows))
    metrics = read_rows(path / "metrics.jsonl")
    speeds = [row["steps_per_s"] for row in metrics if row["steps_per_s"] is not None]
    return Record(
        path=path,
        task=address["task"],
        preset=address["preset"],
        seed=address["seed"],
        adapter=next(iter(adapters), ""),
        selector=next((name for name in selectors if name != BARE), BARE),
        curves={name: _curve(path, [row for row in rows if row["selector"] == name]) for name in selectors},
        status=json.loads((path / "status.json").read_text()),
        steps_per_s=float(np.median(speeds)) if speeds else float("nan"),
        wall_s=float(metrics[-1]["wall_s"]) if metrics else float("nan"),
    )


def _curve(path: Path, rows: list[Row]) -> Curve:
    outcomes: dict[int, dict[int, bool]] = {}
    for row in rows:
        episodes = outcomes.setdefault(row["step"], {})
        if row["start"] in episodes:
            raise RecordError(
                f"{path}: the evaluation at step {row['step']} with selector {row['selector']} counts start "
                f"state {row['start']} twice. Rewind the run to its checkpoint before evaluating again."
            )
        episodes[row["start"]] = bool(row["success_once"])
    steps = sorted(outcomes)
    successes = [sum(outcomes[step].values()) for step in steps]
    return Curve(np.array(steps), np.array(successes), np.array([len(outcomes[step]) for step in steps]))
