"""Runs are laid onto cores, single-threaded, without a question to JAX where no accelerator can be."""

import os
import subprocess
import sys

import pytest

from hcpg.loops import machine
from hcpg.loops.child import Job
from hcpg.loops.population import spread


def test_a_run_on_one_core_keeps_what_the_user_has_set(monkeypatch):
    monkeypatch.setattr(machine, "cores", lambda: 8)
    variables = machine.one_core({"XLA_FLAGS": "--xla_dump_to=/tmp/x", "OMP_NUM_THREADS": "3"}, 3)
    assert variables == {
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "3",
        "MKL_NUM_THREADS": "1",
        "PJRT_NPROC": "2",
        "XLA_FLAGS": f"{machine.ONE_THREAD_XLA} --xla_dump_to=/tmp/x",
    }
    assert machine.one_core(variables) == variables


def test_xla_reads_what_the_user_has_set():
    variables = machine.one_core({**os.environ, "XLA_FLAGS": "--xla_no_such_flag=1"})
    command = [sys.executable, "-c", "import jax; jax.devices()"]
    started = subprocess.run(command, env={**os.environ, **variables}, capture_output=True, text=True)
    assert "Unknown flag in XLA_FLAGS: --xla_no_such_flag=1" in started.stderr


def test_processes_on_one_gpu_share_its_memory():
    assert machine.gpu_share({}, 2) == {"XLA_PYTHON_CLIENT_MEM_FRACTION": "0.38"}
    asked = {"XLA_PYTHON_CLIENT_MEM_FRACTION": "0.2"}
    assert machine.gpu_share(asked, 2) == asked


@pytest.mark.parametrize(("cores", "processes", "workers"), [(2, 3, 1), (2, 2, 1), (8, 3, 2), (8, 1, 8)])
def test_cores_are_shared_among_the_runs(monkeypatch, cores, processes, workers):
    monkeypatch.setattr(machine, "cores", lambda: cores)
    assert machine.cores_each(processes) == workers


def test_a_cpu_gets_a_process_per_run_and_an_accelerator_one_per_job(tmp_path):
    jobs = [Job({}, [0, 1], tmp_path, []), Job({}, [3, 4], tmp_path, [tmp_path / "a", tmp_path / "b"])]
    alone = spread(jobs, accelerated=False)
    assert [job.seeds for job in alone] == [[0], [1], [3], [4]]
    assert [[folder.name for folder in job.folders] for job in alone] == [[], [], ["a"], ["b"]]
    assert spread(jobs, accelerated=True) == jobs


def test_jax_platforms_cpu_needs_no_question(monkeypatch):
    monkeypatch.setattr(machine.subprocess, "run", None)
    assert not machine.has_accelerator({"JAX_PLATFORMS": "cpu"})


def test_with_a_plugin_jax_itself_is_asked(monkeypatch):
    monkeypatch.setattr(machine, "entry_points", lambda group: [group])
    monkeypatch.setattr(machine, "_BACKEND_PROBE", "print('a warning'); print('gpu')")
    assert machine.has_accelerator({})
    monkeypatch.setattr(machine, "_BACKEND_PROBE", "print('cpu')")
    assert not machine.has_accelerator({})


def test_xla_starts_no_more_threads_than_its_share():
    """XLA names its workers `tf_XLAEigen`; the variable must be the one that this JAX reads."""
    count = (
        "import jax; jax.jit(lambda x: x + 1)(1.0).block_until_ready();"
        "from pathlib import Path; names = [p.read_text() for p in Path('/proc/self/task').glob('*/comm')];"
        "print(sum('XLAEigen' in name for name in names))"
    )
    for share in ("1", "3"):
        variables = {**os.environ, **machine.one_core({"PJRT_NPROC": share}), "JAX_PLATFORMS": "cpu"}
        asked = subprocess.run([sys.executable, "-c", count], env=variables, capture_output=True, text=True)
        assert asked.stdout.strip() == share, asked.stderr


def test_processes_keep_to_a_core_where_each_has_one_to_itself(monkeypatch):
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda _: {5, 3})
    assert [machine.core_for(index, 2) for index in range(2)] == [{3}, {5}]
    assert machine.core_for(0, 1) is None
    assert [machine.core_for(index, 3) for index in range(3)] == [None, None, None]
