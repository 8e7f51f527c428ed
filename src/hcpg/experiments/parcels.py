"""Run folders on their way between machines, in parcels whose landing may be cut short at any moment.

A checkpoint arrives whole or not at all, and never before the rows that were written up to it: what is there
when a machine dies can always be resumed.
"""

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from hcpg.report.durable import replace_file

Stamp = tuple[int, int]
"""Time of the last change and size: a file that has kept both is not sent again."""
_PARTS = ("checkpoints", "videos")
"""Folders that belong to a run even while they are empty."""


class Parcel(NamedTuple):
    """Files by their path from the results folder on, and what a receiver shall end up with."""

    files: Mapping[str, bytes]
    checkpoints: Mapping[str, list[str]]
    """By run folder the checkpoints that exist: the receiver drops others."""


def pack(root: Path, runs: Iterable[Path], others: Iterable[Path], sent: dict[str, Stamp]) -> Parcel:
    """What has changed in these run folders and other files under `root`; `sent` is brought up to date."""
    files: dict[str, bytes] = {}
    kept: dict[str, list[str]] = {}
    for run in runs:
        name = str(run.relative_to(root))
        kept[name] = []
        for checkpoint in sorted((run / "checkpoints").glob("step_*")):
            if _add_checkpoint(files, root, checkpoint, sent):
                kept[name].append(checkpoint.name)
        # After the checkpoints: the tables then reach at least as far as the newest one.
        _add(files, root, (path for path in run.iterdir() if path.name != "lock"), sent)
        _add(files, root, (run / "videos").rglob("*"), sent)
    _add(files, root, others, sent)
    return Parcel(files, kept)


def land(parcel: Parcel, root: Path) -> None:
    """Put the parcel's files under `root`; a new run folder, like a checkpoint, appears complete."""
    for run, checkpoints in parcel.checkpoints.items():
        folder = root / run
        target = folder if folder.exists() else folder.with_name(f".arriving-{folder.name}")
        for part in _PARTS:
            (target / part).mkdir(parents=True, exist_ok=True)
        _land_run(_under(f"{run}/", parcel.files), target)
        _drop(target / "checkpoints", checkpoints)
        if target != folder:
            target.rename(folder)
    in_runs = tuple(f"{run}/" for run in parcel.checkpoints)
    for name, content in parcel.files.items():
        if not name.startswith(in_runs):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            replace_file(root / name, content)


def _under(beginning: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files whose names begin so, without that beginning."""
    names = [name for name in files if name.startswith(beginning)]
    return {name.removeprefix(beginning): files[name] for name in names}


def _add(files: dict[str, bytes], root: Path, paths: Iterable[Path], sent: dict[str, Stamp]) -> None:
    for path in paths:
        name = str(path.relative_to(root))
        if path.is_file() and not path.name.startswith("."):
            status = path.stat()
            stamp = status.st_mtime_ns, status.st_size
            if sent.get(name) != stamp:
                files[name], sent[name] = path.read_bytes(), stamp


def _add_checkpoint(files: dict[str, bytes], root: Path, checkpoint: Path, sent: dict[str, Stamp]) -> bool:
    """Add a checkpoint unless it was sent; whether it is still there, whole."""
    found: dict[str, bytes] = {}
    stamps = dict(sent)
    try:
        folder = checkpoint.stat().st_ino
        _add(found, root, list(checkpoint.iterdir()), stamps)
        replaced = checkpoint.stat().st_ino != folder
    except FileNotFoundError:  # the trainer has made newer ones and deleted it
        return False
    if not replaced:
        files |= found
        sent |= stamps
    return not replaced


def _land_run(files: Mapping[str, bytes], folder: Path) -> None:
    checkpoints: dict[str, dict[str, bytes]] = {}
    for name, content in files.items():
        first, _, rest = name.partition("/")
        if first == "checkpoints":
            step, _, file = rest.partition("/")
            checkpoints.setdefault(step, {})[file] = content
        else:
            replace_file(folder / name, content)
    for step, parts in checkpoints.items():
        _land_checkpoint(parts, folder / "checkpoints" / step)


def _land_checkpoint(parts: Mapping[str, bytes], target: Path) -> None:
    arriving = target.with_name(f".arriving-{target.name}")
    if arriving.exists():
        shutil.rmtree(arriving)
    arriving.mkdir()
    for name, content in parts.items():
        replace_file(arriving / name, content)
    if not target.exists():
        arriving.rename(target)


def _drop(folder: Path, kept: list[str]) -> None:
    """Delete the checkpoints that the sender has no more, and what earlier landings left half-done."""
    for path in folder.iterdir():
        if path.name not in kept:
            hidden = path if path.name.startswith(".") else path.rename(folder / f".deleting-{path.name}")
            shutil.rmtree(hidden)
