"""What became of an experiment's runs, read from its results folder; nothing is kept beside the runs."""

import json
from math import isnan
from pathlib import Path
from typing import Literal, NamedTuple

from hcpg.experiments.claims import claim_of, is_locked
from hcpg.experiments.protocols import Cell
from hcpg.loops.runs import RunFolder
from hcpg.report.durations import undisturbed_s
from hcpg.report.records import find_runs

State = Literal["left", "running", "stopped", "failed", "diverged", "finished"]
DONE = ("finished", "diverged")


class Entry(NamedTuple):
    """A cell and its run, if it has one."""

    cell: Cell
    state: State
    """`left`: not begun; `stopped`: to be resumed."""
    folder: Path | None = None
    step: int = 0
    """Environment steps of the newest row of metrics."""
    seconds: float = 0.0
    """Time of training and evaluations up to there, over all sittings; less where it was suspended."""


def entries(cells: list[Cell], results: Path) -> list[Entry]:
    """Every cell with its state, in the order of the cells; `running` where any launch is at it."""
    return [
        entry if entry.state in DONE or not is_locked(claim_of(entry.cell, results)) else _at_work(entry)
        for entry in recorded(cells, results)
    ]


def recorded(cells: list[Cell], results: Path) -> list[Entry]:
    """The same by what the run folders alone say.

    A run belongs to a cell if its whole configuration and its seed are the cell's; of several the newest
    counts.
    """
    found = {_identity(RunFolder(path)): path for path in find_runs(results)} if results.exists() else {}
    return [_entry(cell, found.get(cell.identity())) for cell in cells]


def newest_checkpoint(folder: Path) -> int | None:
    """The environment step of a run's newest checkpoint; None if it has none."""
    steps = [int(path.stem.removeprefix("step_")) for path in (folder / "checkpoints").glob("step_*")]
    return max(steps, default=None)


def _identity(folder: RunFolder) -> tuple[str, int]:
    return json.dumps(folder.config(), sort_keys=True), int(folder.manifest()["run"]["seed"])


def _entry(cell: Cell, path: Path | None) -> Entry:
    if path is None:
        return Entry(cell, "left")
    folder = RunFolder(path)
    state = folder.status()["state"]
    if state == "running" and not folder.in_use():
        state = "stopped"  # its process died without a word
    rows = folder.rows("metrics")
    if not rows:
        return Entry(cell, state, path)
    budget, step = cell.settings.budget, rows[-1]["step"]
    each = budget.steps / budget.evaluations
    seconds = undisturbed_s(rows, [each * (past + 1) for past in range(int(step // each))])
    return Entry(cell, state, path, step, rows[-1]["wall_s"] if isnan(seconds) else seconds)


def _at_work(entry: Entry) -> Entry:
    return entry._replace(state="running")
