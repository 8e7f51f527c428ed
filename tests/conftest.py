"""What holds for every test: one thread per process, JAX on the CPU, compiled programs kept between runs.

The variables are set before JAX is imported. NumPy may be loaded already (by a pytest plug-in): its one
thread holds for the processes started from here, so for the workers of `pytest -n 2` and for child processes.
"""

import gc
import os
import sys
from pathlib import Path

import psutil
import pytest
from hypothesis import settings

_CACHE = Path(__file__).parents[1] / ".cache"
# Three quarters of the suite's time went into XLA's code generation: here programs are compiled quickly, not
# well. What learns takes its optimisations back (tests/methods/training.py).
_QUICKLY_COMPILED = (
    "--xla_cpu_multi_thread_eigen=false "
    "--xla_cpu_use_fusion_emitters=false "
    "--xla_backend_optimization_level=1 "
    "--xla_cpu_parallel_codegen_split_count=1"
)

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("XLA_FLAGS", _QUICKLY_COMPILED)
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(_CACHE / "jax"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")

# The same examples on every machine: a failure seen once is seen again. No deadline: the first call compiles.
settings.register_profile("hcpg", derandomize=True, deadline=None, database=None)
settings.load_profile("hcpg")

_MUCH_MEMORY_BYTES = 2 << 30

# Tracing makes millions of objects that live on, and the collector looked at them again and again: an eighth
# of the time of tests that compile.
gc.set_threshold(200_000, 50, 1000)


# Files that take longest, as measured. They come first: were one the last, a worker would wait for it alone.
_LONG = (
    "test_sac_flow_learns",
    "test_cli",
    "test_probes",
    "test_cluster",
    "test_flowrl_learns",
    "test_maniskill_numpy_stepping",
    "test_sac_learns",
    "test_qsm_learns",
    "test_point_probe",
    "test_training",
    "test_conformance",
    "test_cloning",
)


def pytest_collection_modifyitems(items):
    """Files stay whole, and in the order of their names but for the long ones."""
    places = {name: place for place, name in enumerate(_LONG)}
    items.sort(key=lambda item: places.get(item.path.stem, len(_LONG)))


def pytest_collection_finish():
    """What is imported by now stays; the collector need not look at it."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True, scope="module")
def forget_programs():
    """Compiled programs are kept for one file's tests; those of all files would fill a small machine."""
    yield
    if "jax" in sys.modules and psutil.Process().memory_info().rss > _MUCH_MEMORY_BYTES:
        sys.modules["jax"].clear_caches()
