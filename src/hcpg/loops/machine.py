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
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_BACKEND_PROBE = "import jax; print(jax.default_backend())"
_GPU_SHARE = 0.75


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def workers_per_run(processes: int) -> int:
    """Environment workers of each process; what is computed does not depend on it."""
    return max(1, cores() // processes)


def core_for(index: int, processes: int) -> set[int] | None:
    """The core that process `index` of so many shall keep to; None where there are more cores than processes.

    Left to the scheduler, three learners on two cores took 3.5 times the time of one, kept to a core each 2.9
    (docs/evidence/speed).
    """
    allowed = sorted(os.sched_getaffinity(0))
    return None if processes < len(allowed) else {allowed[index % len(allowed)]}


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


def one_core(environment: Mapping[str, str]) -> dict[str, str]:
    """The variables for a process that computes on one core; what the user has set wins."""
    given = environment.get("XLA_FLAGS", "")
    flags = given if ONE_THREAD_XLA in given else f"{ONE_THREAD_XLA} {given}".strip()
    return {**{name: environment.get(name, "1") for name in _THREADS}, "XLA_FLAGS": flags}


def gpu_share(environment: Mapping[str, str], processes: int) -> dict[str, str]:
    """The variables for one of several processes on one GPU; what the user has set wins."""
    name = "XLA_PYTHON_CLIENT_MEM_FRACTION"
    return {name: environment.get(name, f"{_GPU_SHARE / processes:.2f}")}
