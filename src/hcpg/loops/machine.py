"""How runs are laid onto this machine: one process per run on a CPU, all runs of a setting in one on a GPU.

XLA's CPU backend gains little from a second thread and nothing from `vmap`, so single-threaded processes side
by side are the fastest there. Nothing here imports JAX: a process that only asks must not take the GPU.
"""

import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import entry_points
from importlib.util import find_spec

ONE_THREAD_XLA = "--xla_cpu_multi_thread_eigen=false"
_XLA_THREADS = "PJRT_NPROC"
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_BACKEND_PROBE = "import jax; print(jax.default_backend())"
_GPU_SHARE = 0.75


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def cores_each(processes: int) -> int:
    """Each process's share of the cores, at least one: so many environment workers and threads of XLA.

    What is computed does not depend on it.
    """
    return max(1, cores() // processes)


def core_for(index: int, processes: int) -> set[int] | None:
    """The core that process `index` of so many shall keep to, where each has one to itself; otherwise None.

    More processes than cores are the scheduler's to lay out: kept to cores, those that share one go on
    sharing it when the others have ended (docs/evidence/speed).
    """
    allowed = sorted(os.sched_getaffinity(0))
    return {allowed[index]} if processes == len(allowed) else None


def has_accelerator(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether JAX would compute on a GPU or TPU here.

    Raises:
        subprocess.CalledProcessError: JAX does not start; its own message is on stderr.
    """
    plugins = entry_points(group="jax_plugins") or find_spec("jax_plugins") or find_spec("libtpu")
    if environment.get("JAX_PLATFORMS") == "cpu" or not plugins:
        return False
    command = [sys.executable, "-c", _BACKEND_PROBE]
    asked = subprocess.run(command, env=dict(environment), stdout=subprocess.PIPE, text=True, check=True)
    return asked.stdout.split()[-1] != "cpu"


def one_core(environment: Mapping[str, str], processes: int = 1) -> dict[str, str]:
    """The variables for one of several processes that each compute on one core; what the user has set wins.

    XLA starts a thread for each core that it may use, and they wait for each other within one update. Three
    processes on two cores would have six; kept to their share, they take a fifth less time
    (docs/evidence/speed).
    """
    given = environment.get("XLA_FLAGS", "")
    flags = given if ONE_THREAD_XLA in given else f"{ONE_THREAD_XLA} {given}".strip()
    share = {_XLA_THREADS: environment.get(_XLA_THREADS, str(cores_each(processes)))}
    return {**{name: environment.get(name, "1") for name in _THREADS}, **share, "XLA_FLAGS": flags}


def gpu_share(environment: Mapping[str, str], processes: int) -> dict[str, str]:
    """The variables for one of several processes on one GPU; what the user has set wins."""
    name = "XLA_PYTHON_CLIENT_MEM_FRACTION"
    return {name: environment.get(name, f"{_GPU_SHARE / processes:.2f}")}
