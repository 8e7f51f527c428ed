"""Where a run's numbers come from: versions, code, machine, protocol; how exactly they can be repeated."""

import os
import platform
import shlex
import sys
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import jax

from hcpg.report.checkout import own_code

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
        "command": command(),
        "versions": versions(),
        "code": own_code(),
        "platform": platform.platform(),
        "hardware": hardware(),
        "guarantee": _GUARANTEES["cpu" if jax.default_backend() == "cpu" else "gpu"],
        "effective_batch": effective_batch,
        "update_ratio": update_ratio,
        "evaluation_starts": [int(start) for start in evaluation_starts],
        "selectors": {"training": dict(training_selector), "evaluation": dict(evaluation_selector)},
    }


def command() -> str:
    """This process's command line, without where the program lies on this machine."""
    program = Path(sys.argv[0]).name
    return shlex.join(["hcpg" if program == "__main__.py" else program, *sys.argv[1:]])


def versions() -> dict[str, str]:
    """The version of Python and of every installed package, by name."""
    installed = {found.name.lower(): found.version for found in distributions()}
    return {"python": platform.python_version(), **dict(sorted(installed.items()))}


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


def _cpu_model() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
