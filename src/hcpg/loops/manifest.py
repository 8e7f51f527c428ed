"""Where a run's numbers come from: versions, code, machine, protocol; how exactly they can be repeated."""

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import jax

import hcpg

_GUARANTEES = {
    "cpu": "bit-equal on CPU with the same versions",
    "gpu": "statistically equal: GPU kernels do not add in a fixed order",
}


def collect(
    *,
    effective_batch: int,
    update_ratio: float,
    evaluation_starts: Iterable[int],
    training_selector: Mapping[str, Any],
    evaluation_selector: Mapping[str, Any],
) -> dict[str, Any]:
    """Everything that belongs into `manifest.json`, as JSON can hold it.

    Args:
        effective_batch: transitions per gradient step of one run.
        update_ratio: gradient steps per environment step.
        evaluation_starts: the start states of every evaluation, in order.
        training_selector: the selector's settings while collecting.
        evaluation_selector: its settings in evaluations.
    """
    return {
        "time": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        "command": shlex.join(sys.argv),
        "versions": versions(),
        "code": code(Path(hcpg.__file__).resolve().parents[2]),
        "platform": platform.platform(),
        "hardware": hardware(),
        "guarantee": _GUARANTEES["cpu" if jax.default_backend() == "cpu" else "gpu"],
        "effective_batch": effective_batch,
        "update_ratio": update_ratio,
        "evaluation_starts": [int(start) for start in evaluation_starts],
        "selectors": {"training": dict(training_selector), "evaluation": dict(evaluation_selector)},
    }


def versions() -> dict[str, str]:
    """The version of Python and of every installed package, by name."""
    installed = {found.name.lower(): found.version for found in distributions()}
    return {"python": platform.python_version(), **dict(sorted(installed.items()))}


def code(root: Path) -> dict[str, Any]:
    """The commit of the checkout at `root`, whether it was altered, and the SHA-256 of each lock file.

    The commit is None where the package was installed from a wheel, or without git.
    """
    files = sorted((root / "requirements").glob("*.txt"))
    locks = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    checkout = (root / ".git").exists() and shutil.which("git") is not None
    commit = _git(root, "rev-parse", "HEAD") if checkout else None
    altered = _git(root, "status", "--porcelain") if checkout else None
    return {"commit": commit, "dirty": None if altered is None else altered != "", "locks": locks}


def hardware() -> dict[str, Any]:
    """The processor's model, its cores and those this process may use, memory in GiB, and the accelerator."""
    memory_bytes = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    devices = jax.devices()
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "usable_cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(memory_bytes / 2**30, 1),
        "accelerator": None if devices[0].platform == "cpu" else devices[0].device_kind,
        "devices": len(devices),
    }


def _git(root: Path, *arguments: str) -> str | None:
    """What git answers, or None where it refuses (a checkout of another user, say)."""
    done = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else None


def _cpu_model() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
