"""Compiled programs kept between starts, so that only a machine's first run waits for the compiler.

JAX writes an entry of its cache in place, so a kill could leave half of one there for ever. A process
therefore works in a folder of its own, filled with links to the shared entries, and moves what it compiled
into the shared folder in whole files.
"""

import hashlib
import os
import platform
import secrets
import shutil
import time
from collections.abc import MutableMapping
from pathlib import Path

LEFT_BEHIND_S = 7 * 24 * 3600.0
"""Age at which the folder of a process that was killed is deleted."""


class CompiledPrograms:
    """One process's view of the programs compiled so far."""

    def __init__(self, shared: Path) -> None:
        """Link all entries of `shared` into a new folder, `path`."""
        shared.mkdir(parents=True, exist_ok=True)
        _sweep(shared)
        self._shared = shared
        self.path = shared / f".process-{os.getpid()}-{secrets.token_hex(4)}"
        self.path.mkdir()
        self._known = {entry.name for entry in _entries(shared)}
        for name in self._known:
            (self.path / name).hardlink_to(shared / name)

    def publish(self) -> int:
        """Let later processes have what was compiled here since the last call; how many programs it was.

        Call it while nothing is being compiled.
        """
        new = [entry for entry in _entries(self.path) if entry.name not in self._known]
        for entry in new:
            beside = self._shared / f".{entry.name}.{secrets.token_hex(4)}"
            beside.hardlink_to(entry)
            beside.rename(self._shared / entry.name)
        self._known |= {entry.name for entry in new}
        return len(new)

    def close(self) -> None:
        """Publish, and delete the process's own folder."""
        self.publish()
        shutil.rmtree(self.path)


def open_programs(environment: MutableMapping[str, str]) -> CompiledPrograms | None:
    """Point JAX, which must not be imported yet, to the compiled programs.

    None where the user's own JAX_COMPILATION_CACHE_DIR decides, or no cache folder can be written.
    """
    if "JAX_COMPILATION_CACHE_DIR" in environment:
        return None
    shared = shared_folder(environment)
    if not _is_writable(shared):
        return None
    programs = CompiledPrograms(shared)
    environment["JAX_COMPILATION_CACHE_DIR"] = str(programs.path)
    environment.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.5")
    # XLA's own GPU caches would make the folder's name part of every entry's key: nothing would be found.
    environment["JAX_PERSISTENT_CACHE_ENABLE_XLA_CACHES"] = "none"
    return programs


def shared_folder(environment: MutableMapping[str, str]) -> Path:
    """Where a user's compiled programs lie, by kind of processor: code made for another one may crash."""
    base = environment.get("XDG_CACHE_HOME") or f"{environment.get('HOME', '')}/.cache"
    return Path(base) / "hcpg-flow" / "compiled" / _processor()


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else [platform.processor()]
    abilities = sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))})
    digest = hashlib.sha256("\n".join(abilities).encode()).hexdigest()
    return f"{platform.machine()}-{digest[:12]}"


def _is_writable(folder: Path) -> bool:
    nearest = next(each for each in (folder, *folder.parents) if each.exists())
    return nearest.is_dir() and os.access(nearest, os.W_OK)


def _entries(folder: Path) -> list[Path]:
    return [entry for entry in folder.iterdir() if not entry.name.startswith(".")]


def _sweep(shared: Path) -> None:
    for leftover in shared.glob(".process-*"):
        if time.time() - leftover.stat().st_mtime > LEFT_BEHIND_S:
            shutil.rmtree(leftover)
