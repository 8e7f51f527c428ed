"""Pictures without a display."""

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from trajectories import actions_of, trajectory

from hcpg import registry
from hcpg.suites import metaworld as suite
from hcpg.types import RenderingError

ROOT = Path(__file__).parents[2]
DRAWER = registry.task("metaworld/drawer-open")


def can_draw():
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    return True


@pytest.mark.skipif(not can_draw(), reason="needs libegl1")
def test_pictures_need_no_display_are_upright_and_change_nothing(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "")
    monkeypatch.delenv("DISPLAY", raising=False)
    environment, actions = suite.SUITE.make(DRAWER, seed=0), actions_of(5, 30)
    undrawn = trajectory(environment, 0, actions)
    environment.reset(0)
    before = environment.render()
    drawn = [environment.step(action) for action in actions]
    after = environment.render()
    assert (before.shape, before.dtype) == ((480, 480, 3), np.uint8)
    assert np.mean(before != after) > 0.01
    assert np.array_equal(drawn[-1].observation, undrawn[-1, :39])
    red, green, blue = np.moveaxis(before.astype(int), -1, 0)
    arm = np.argwhere((red > 100) & (green < 60) & (blue < 60))
    table = np.argwhere((red > green + 15) & (green > blue + 5) & (red < 160) & (green > 60))
    assert len(arm) > 5000
    assert len(table) > 5000
    assert arm[:, 0].mean() + 50 < table[:, 0].mean()
    environment.close()


@pytest.mark.skipif(not can_draw(), reason="needs libegl1")
def test_two_environments_draw_in_turn(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "egl")
    one = suite.SUITE.make(DRAWER, seed=0)
    other = suite.SUITE.make(registry.task("metaworld/button-press"), seed=0)
    one.reset(0)
    other.reset(1)
    first, second = one.render(), other.render()
    assert np.array_equal(one.render(), first)
    assert np.array_equal(other.render(), second)
    assert np.mean(first != second) > 0.01
    one.close()
    assert np.array_equal(other.render(), second)
    other.close()


@pytest.mark.skipif(not can_draw(), reason="needs libegl1")
def test_a_viewer_that_nobody_closed_ends_in_silence():
    code = (
        "from hcpg import registry; task = registry.task('metaworld/drawer-open')\n"
        "environment = registry.suite('metaworld').make(task, 0); environment.reset(0)\n"
        "print(environment.render().shape)"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "MUJOCO_GL": "egl"}
    told = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert (told.stdout, told.stderr) == ("(480, 480, 3)\n", "")


def test_a_missing_library_stops_pictures_with_its_cure_and_nothing_else(monkeypatch):
    monkeypatch.setitem(suite.OPENGL_LIBRARIES, "egl", "libNoSuchLibrary.so.1")
    monkeypatch.setenv("MUJOCO_GL", "")
    environment = suite.SUITE.make(DRAWER, seed=0)
    environment.reset(0)
    assert environment.step(np.zeros(4, np.float32)).reward >= 0.0
    with pytest.raises(RenderingError, match="libNoSuchLibrary") as stopped:
        environment.render()
    assert "MUJOCO_GL=egl" in str(stopped.value)
    assert "scripts/install_system_packages.sh" in str(stopped.value)
    assert "sudo apt-get install libegl1 libgl1-mesa-dri" in str(stopped.value)
    environment.close()


def test_the_users_own_choice_of_library_is_kept_and_checked_first(monkeypatch):
    monkeypatch.setitem(suite.OPENGL_LIBRARIES, "osmesa", "libNoSuchLibrary.so.1")
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(RenderingError, match="MUJOCO_GL=osmesa"):
        suite.SUITE.make(DRAWER, seed=0)
    assert os.environ["MUJOCO_GL"] == "osmesa"
