"""ManiSkill with a renderer, and without any Vulkan device: the same numbers, and pictures of them."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from maniskill_rollouts import NAMES, rollout

from hcpg import registry
from hcpg.loops import doctor
from hcpg.loops.pool import Pool
from hcpg.suites.maniskill import control_mode, pictures
from hcpg.suites.maniskill.building import build_stage
from hcpg.types import RenderingError

HERE = Path(__file__).parent
NO_DRIVER = {"VK_DRIVER_FILES": "/nowhere", "VK_ICD_FILENAMES": "/nowhere"}


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """What a machine without a Vulkan device comes to: rollouts by task, and what it said."""
    file = tmp_path_factory.mktemp("bare") / "rollouts.npz"
    told = subprocess.run(
        [sys.executable, HERE / "maniskill_rollouts.py", file],
        env={**os.environ, **NO_DRIVER, "PYTHONPATH": str(HERE.parents[1] / "src")},
        capture_output=True,
        text=True,
        check=True,
    )
    return np.load(file), told


@pytest.fixture(scope="module")
def stages():
    """ManiSkill's own environments with everything visible in them, by task; none where nothing can draw."""
    if doctor.vulkan().ok is not True:
        pytest.skip("needs a Vulkan device: scripts/install_system_packages.sh vulkan")
    tasks = {name: registry.task(f"maniskill/{name}") for name in NAMES}
    built = {name: build_stage(task.env_id, control_mode(task)) for name, task in tasks.items()}
    yield {name: (stage, rollout(name, stage)) for name, stage in built.items()}
    for each in built.values():
        each.close()


def test_it_steps_without_a_vulkan_device_and_says_why_it_cannot_draw(bare):
    rollouts, told = bare
    assert [rollouts[name].shape for name in NAMES] == [(31, 37), (31, 37), (31, 44), (31, 56)]
    stopped, shape = told.stdout.splitlines()
    assert stopped.startswith("RenderingError cannot draw with Vulkan: ")
    assert "scripts/install_system_packages.sh vulkan" in stopped
    assert "Training needs no Vulkan." in stopped
    assert shape == "(35,)"
    # Every hand came to touch something: the object has moved, or the flag or the fingers say so.
    moved = [abs(rollouts[name][-1] - rollouts[name][0]) for name in NAMES]
    assert moved[0][28] > 0.05
    assert moved[1][28] > 0.05
    assert moved[2][31] > 0.02
    assert moved[3][33] + moved[3][32] > 0.02


@pytest.mark.parametrize("name", NAMES)
def test_leaving_out_what_is_visible_changes_no_bit(bare, stages, name):
    np.testing.assert_array_equal(bare[0][name], stages[name][1])


def test_a_picture_is_the_one_that_the_package_draws_and_changes_nothing(stages, monkeypatch):
    task = registry.task("maniskill/push-cube")
    environment, (stage, rows) = registry.suite("maniskill").make(task, seed=0), stages["push-cube"]
    np.testing.assert_array_equal(rollout("push-cube", environment._stepping.simulation), rows)
    expected = stage.render_rgb_array()[0].numpy()
    stage.reset(seed=0)
    # Compiling what draws takes most of the time, so the camera gets a stage that has drawn before.
    monkeypatch.setattr(pictures, "build_stage", lambda env_id, mode: stage)
    picture = environment.render()
    assert (picture.shape, picture.dtype) == ((512, 512, 3), np.uint8)
    np.testing.assert_array_equal(picture, expected)
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    cube = np.argwhere((blue > red + 60) & (blue > green + 60))
    disc = np.argwhere((red > green + 60) & (abs(green - blue) < 25))
    assert len(cube) > 100
    assert len(disc) > 1000
    undrawn = [environment.reset(0), environment.step(np.ones(4, np.float32)).observation]
    environment.reset(0)
    assert np.mean(environment.render() != picture) > 0.01
    assert np.array_equal(environment.step(np.ones(4, np.float32)).observation, undrawn[1])
    monkeypatch.setattr(stage, "close", lambda: None)  # the fixture's to close
    environment.close()


def test_what_cannot_be_drawn_is_told_with_its_cure(monkeypatch):
    def refuse(env_id, mode):
        raise RuntimeError("failed to find a rendering device")

    monkeypatch.setattr(pictures, "build_stage", refuse)
    with pytest.raises(RenderingError, match="failed to find a rendering device") as stopped:
        pictures.Camera("PushCube-v1", "pd_ee_delta_pos")
    assert "Mesa 24 or newer" in str(stopped.value)


def test_a_worker_that_cannot_draw_says_so_without_a_traceback(monkeypatch):
    for name, value in NO_DRIVER.items():
        monkeypatch.setenv(name, value)
    with Pool("maniskill/push-cube", [0], workers=1) as pool:
        pool.reset(np.array([0]))
        with pytest.raises(RenderingError) as stopped:
            pool.render(0)
    assert str(stopped.value).startswith("cannot draw with Vulkan: ")
    assert "scripts/install_system_packages.sh vulkan" in str(stopped.value)
    assert len(str(stopped.value).splitlines()) == 1
