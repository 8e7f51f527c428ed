"""Runs that another experiment has made already: the paper's tables share many."""

import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from hcpg.experiments.claims import claim_of, locked
from hcpg.experiments.ledger import DONE, Entry, recorded
from hcpg.experiments.protocols import Cell


def adopt(cells: list[Cell], results: Path, neighbours: Iterable[Path]) -> list[Path]:
    """Take over the runs of these cells that the neighbours' results folders have; gives the new folders.

    Only finished and diverged ones count. They are copies, but for the checkpoints' arrays: nobody changes
    those, so they are the same files under a second name.
    """
    left = [entry.cell for entry in recorded(cells, results) if entry.state not in DONE]
    made: dict[tuple[str, int], Path] = {}
    for neighbour in neighbours:
        for entry in recorded(left, neighbour):
            identity = entry.cell.identity()
            if entry.state in DONE and identity not in made and (run := _adopted(entry, neighbour, results)):
                made[identity] = run
    return list(made.values())


def _adopted(entry: Entry, neighbour: Path, results: Path) -> Path | None:
    """The run's new folder; None if another launch has the cell at present."""
    claim = locked(claim_of(entry.cell, results))
    if claim is None or entry.folder is None:
        return None
    with claim:
        target = results / entry.folder.relative_to(neighbour)
        arriving = target.with_name(f".arriving-{target.name}")
        if arriving.exists():
            shutil.rmtree(arriving)
        shutil.copytree(entry.folder, arriving, copy_function=_copied)
        arriving.rename(target)
    return target


def _copied(source: str, target: str) -> None:
    if Path(source).suffix == ".safetensors":
        os.link(source, target)
    else:
        shutil.copy2(source, target)
