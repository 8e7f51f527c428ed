"""What became of an experiment's runs, read from its results folder; nothing is kept beside the runs."""

import json
from pathlib import Path
from typing import Literal, NamedTuple

from hcpg.experiments.protocols import Cell
from hcpg.loops.runs import RunFolder
from hcpg.report.records import find_runs

State = Literal["left", "running", "stopped", "failed", "diverged", "finished"]
DONE = ("finished", "diverged")


class Entry(NamedTuple):
    """A cell and its run, if it has one."""

    cell: Cell
    state: State
    """`left`: not begun; `stopped`: to be resumed."""
    folder: Path | None = None
    seconds: float | None = None
    """Training time of a finished run, over all its sittings."""


def entries(cells: list[Cell], results: Path) -> list[Entry]:
    """Every cell with its state, in the order of the cells.

    A run belongs to a cell if its whole configuration and its seed are the cell's; of several the newest
    counts.
    """
    found = {_key(RunFolder(path)): path for path in find_runs(results)} if results.exists() else {}
    return [_entry(cell, found.get(identity(cell))) for cell in cells]


def identity(cell: Cell) -> tuple[str, int]:
    """What a run must have to be the cell's: its whole configuration, and its seed."""
    return json.dumps(cell.settings.as_json(), sort_keys=True), cell.seed


def _key(folder: RunFolder) -> tuple[str, int]:
    return json.dumps(folder.config(), sort_keys=True), int(folder.manifest()["run"]["seed"])


def _entry(cell: Cell, path: Path | None) -> Entry:
    if path is None:
        return Entry(cell, "left")
    folder = RunFolder(path)
    state = folder.status()["state"]
    if state == "running" and not folder.in_use():
        state = "stopped"  # its process died without a word
    return Entry(cell, state, path, _seconds(folder) if state == "finished" else None)


def _seconds(folder: RunFolder) -> float | None:
    rows = folder.rows("metrics")
    return float(rows[-1]["wall_s"]) if rows else None


def hours_left(entries: list[Entry], slots: int) -> float | None:
    """Hours until all is done on `slots` cores, from what finished runs of the same preset took.

    None before any run has finished.
    """
    taken: dict[str, list[float]] = {}
    for entry in entries:
        if entry.seconds is not None:
            taken.setdefault(entry.cell.settings.preset, []).append(entry.seconds)
    if not taken:
        return None
    means = {preset: sum(each) / len(each) for preset, each in taken.items()}
    usual = sum(means.values()) / len(means)
    open_ends = [entry.cell.settings.preset for entry in entries if entry.state not in DONE]
    return sum(means.get(preset, usual) for preset in open_ends) / slots / 3600
