"""The manifest says what an independent look at the machine and the checkout says."""

import json
import subprocess
import sys

import numpy as np
import pytest

from hcpg.loops.manifest import collect, command, hardware, versions


def test_collect_goes_through_json_unchanged(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["hcpg", "train", "--task", "a b"])
    manifest = collect(
        effective_batch=256,
        update_ratio=0.25,
        evaluation_starts=range(3),
        training_selector={"rule": "hcpg", "temperature": 0.7},
        evaluation_selector={"rule": "first"},
    )
    assert json.loads(json.dumps(manifest, allow_nan=False)) == manifest
    assert manifest["evaluation_starts"] == [0, 1, 2]
    assert manifest["selectors"] == {
        "training": {"rule": "hcpg", "temperature": 0.7},
        "evaluation": {"rule": "first"},
    }
    assert (manifest["effective_batch"], manifest["update_ratio"]) == (256, 0.25)
    assert manifest["guarantee"] == "bit-equal on CPU with the same versions"
    assert manifest["command"] == "hcpg train --task 'a b'"


def test_versions_are_the_imported_ones():
    import jax
    import optax

    found = versions()
    assert found["python"] == ".".join(map(str, sys.version_info[:3]))
    assert (found["jax"], found["optax"], found["numpy"]) == (
        jax.__version__,
        optax.__version__,
        np.__version__,
    )


def test_hardware_agrees_with_the_system():
    found = hardware()
    # An empty environment: nproc would obey OMP_NUM_THREADS.
    usable = subprocess.run(["nproc"], capture_output=True, text=True, check=True, env={})
    assert found["usable_cores"] == int(usable.stdout)
    total = subprocess.run(["nproc", "--all"], capture_output=True, text=True, check=True, env={})
    assert found["cores"] == int(total.stdout)
    with open("/proc/meminfo") as file:
        total_kib = int(file.readline().split()[1])
    assert found["memory_gib"] == pytest.approx(total_kib / 2**20, abs=0.1)
    assert found["accelerator"] is None


@pytest.mark.parametrize(
    ("program", "told"),
    [
        ("/a/.venv/bin/hcpg", "hcpg train x"),
        ("/a/src/hcpg/__main__.py", "hcpg train x"),  # as `hcpg experiment` starts its jobs
        ("scripts/demo.py", "demo.py train x"),
    ],
)
def test_the_command_does_not_tell_where_the_program_lies(program, told, monkeypatch):
    monkeypatch.setattr(sys, "argv", [program, "train", "x"])
    assert command() == told
