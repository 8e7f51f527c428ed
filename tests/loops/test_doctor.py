"""Each thing that the doctor looks at, on machines that lack it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hcpg.loops import doctor

Usage = type(shutil.disk_usage("."))


def shim(folder: Path, package: str, code: str) -> str:
    """A PYTHONPATH on which `package` is `code`."""
    (folder / f"{package}.py").write_text(code)
    return str(folder)


def test_every_failure_has_a_cure_and_nothing_else_has():
    found = doctor.examine()
    assert [bool(finding.cure) for finding in found] == [finding.ok is not True for finding in found]
    names = [finding.name for finding in found]
    assert names[:4] == ["python", "disk", "memory", "shared memory"]
    assert names[-6:] == ["jax device", "jax flags", "rendering", "vulkan", "ffmpeg", "git"]
    assert "numpy" in names


def test_only_pythons_with_a_build_of_every_package_pass():
    versions = [(3, 10, 14), (3, 11, 0), (3, 13, 9), (3, 14, 0)]
    assert [doctor.python_version(version).ok for version in versions] == [False, True, True, False]
    assert doctor.python_version((3, 10, 14)).value.startswith("3.10.14 ")


@pytest.mark.parametrize(("free", "ok", "value"), [(3.94e9, "warning", "3.9 GB"), (4.06e9, True, "4.1 GB")])
def test_a_disk_wants_four_gigabytes(monkeypatch, free, ok, value):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(9e9, 9e9 - free, free))
    finding = doctor.free_disk()
    assert (finding.ok, finding.value[:6]) == (ok, value)


@pytest.mark.parametrize(("free", "ok"), [(63e6, False), (64e6, True)])
def test_shared_memory_wants_what_docker_gives_unless_told(monkeypatch, tmp_path, free, ok):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1e9, 1e9 - free, free))
    finding = doctor.shared_memory(tmp_path)
    assert (finding.ok, finding.value) == (ok, f"{free / 1e6:.0f} MB free in {tmp_path}")


def test_a_machine_without_shared_memory_is_told_how_to_mount_it(tmp_path):
    missing = tmp_path / "shm"
    assert doctor.shared_memory(missing) == (
        "shared memory",
        False,
        f"no {missing}",
        f"sudo mount -t tmpfs tmpfs {missing}",
    )


def test_packages_are_held_against_their_bounds(monkeypatch, tmp_path):
    def installed(name: str, version: str, *more: str) -> None:
        folder = tmp_path / f"{name}-{version}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text("\n".join([f"Name: {name}", f"Version: {version}", *more]))

    installed("fits", "2.1")
    installed("old", "1.9")
    extras = [f"Provides-Extra: {extra}" for extra in ("train", "video", "test")]
    needs = ["fits>=2", "old<3,>=2; extra == 'train'", "absent; extra == 'train'"]
    needs += ["fits>=2; extra == 'video'", "lens>=1; extra == 'video'", "checker; extra == 'test'"]
    installed("hcpg_flow", "9", *extras, *(f"Requires-Dist: {need}" for need in needs))
    monkeypatch.syspath_prepend(tmp_path)
    assert [tuple(finding) for finding in doctor.packages()] == [
        ("fits", True, "2.1 (asked for: >=2)", ""),
        ("old", False, "1.9 (asked for: <3,>=2)", "make install, or: pip install 'hcpg-flow[train]'"),
        ("absent", False, "not installed", "make install, or: pip install 'hcpg-flow[train]'"),
        ("lens", "warning", "not installed", "make install, or: pip install 'hcpg-flow[video]'"),
    ]


def test_an_unknown_jax_platform_is_a_finding(monkeypatch):
    monkeypatch.setenv("JAX_PLATFORMS", "abacus")
    finding = doctor.jax_device()
    assert finding.ok is False
    assert "abacus" in finding.value
    assert "export JAX_PLATFORMS=cpu" in finding.cure


def test_the_device_is_the_one_that_jax_names(monkeypatch, tmp_path):
    chip = (
        "class chip: device_kind = 'NVIDIA H100'\ndevices = lambda: [chip]\ndefault_backend = lambda: 'gpu'"
    )
    monkeypatch.setenv("PYTHONPATH", shim(tmp_path, "jax", chip))
    assert doctor.jax_device() == ("jax device", True, "gpu NVIDIA H100", "")


def test_a_driver_that_hangs_or_crashes_is_a_finding(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", shim(tmp_path, "jax", "import os; os.kill(os.getpid(), 11)"))
    assert doctor.jax_device().value == "the process ended with -11"
    shim(tmp_path, "jax", "import time; time.sleep(60)")
    monkeypatch.setattr(doctor, "_PROBE_TIMEOUT_S", 0.5)
    assert doctor.jax_device().value == "no answer within 0.5 s"


@pytest.mark.parametrize(
    ("name", "value", "ok"),
    [
        ("XLA_PYTHON_CLIENT_MEM_FRACTION", ".50", True),
        ("XLA_PYTHON_CLIENT_MEM_FRACTION", "1.0", True),
        ("XLA_PYTHON_CLIENT_MEM_FRACTION", "0", False),
        ("XLA_PYTHON_CLIENT_MEM_FRACTION", "50", False),
        ("XLA_PYTHON_CLIENT_PREALLOCATE", "false", True),
        ("XLA_PYTHON_CLIENT_PREALLOCATE", "no", False),
    ],
)
def test_memory_flags_that_jax_would_misread_fail(name, value, ok):
    finding = doctor.jax_flags({name: value, "HOME": "/root"})
    assert (finding.ok, finding.value) == (ok, f"{name}={value}")


def test_a_machine_without_opengl_is_told_which_package_to_install():
    # The loader of EGL finds no driver, as on a server without one; where EGL itself is missing it fails too.
    bare = {**os.environ, "MUJOCO_GL": "egl", "__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere"}
    finding = doctor.rendering(bare)
    assert (finding.name, finding.ok) == ("rendering", "warning")
    assert finding.value.startswith("MUJOCO_GL=egl: ")
    assert "Error: " in finding.value
    packages = "libegl1 libgl1-mesa-dri"
    assert finding.cure == f"sudo scripts/install_system_packages.sh, or: sudo apt-get install {packages}"


def test_rendering_is_tried_with_egl_unless_told(tmp_path):
    code = "import os\nraise ImportError('no ' + os.environ['MUJOCO_GL'])"
    quiet = {"PYTHONPATH": shim(tmp_path, "mujoco", code)}
    assert doctor.rendering(quiet).value == "MUJOCO_GL=egl: ImportError: no egl"
    finding = doctor.rendering({**quiet, "MUJOCO_GL": "glfw"})
    assert finding.value == "MUJOCO_GL=glfw: ImportError: no glfw"
    assert finding.cure.endswith("; then: unset MUJOCO_GL")


SAPIEN = """
class render:
    RenderSystem = lambda device: {system}
    get_device_summary = lambda: "GPU: {name}\\n  Supported: 1\\n"
class Device:
    def __init__(self, name):
        if name not in {devices}: raise RuntimeError("failed to find device " + name)
        self.name = name
    def is_cuda(self): return self.name == "cuda"
"""


@pytest.mark.parametrize(
    ("devices", "system", "name", "ok", "value"),
    [
        (("cuda", "cpu"), "0", "NVIDIA H100", True, "GPU: NVIDIA H100"),
        (("cpu",), "0", "llvmpipe (LLVM 15)", True, "processor: llvmpipe (LLVM 15)"),
        (
            ("cpu",),
            "Device('none')",
            "",
            "warning",
            "none: failed to find device none. ManiSkill",
        ),
    ],
)
def test_sapien_draws_on_a_gpu_on_the_processor_or_not_at_all(
    monkeypatch, tmp_path, devices, system, name, ok, value
):
    shim(tmp_path, "cv2", "")
    code = SAPIEN.format(devices=devices, system=system, name=name)
    finding = doctor.vulkan({**os.environ, "PYTHONPATH": shim(tmp_path, "sapien", code)})
    assert (finding.name, finding.ok) == ("vulkan", ok)
    assert finding.value.startswith(value)
    assert ("install_system_packages.sh vulkan" in finding.cure) == (ok == "warning")


def test_a_library_that_sapien_misses_is_named_with_its_cure(tmp_path):
    code = "raise ImportError('libX11.so.6: cannot open shared object file')"
    shim(tmp_path, "cv2", "")
    finding = doctor.vulkan({**os.environ, "PYTHONPATH": shim(tmp_path, "sapien", code)})
    assert finding.ok == "warning"
    assert finding.value == "ManiSkill cannot start: ImportError: libX11.so.6: cannot open shared object file"
    assert finding.cure.endswith("sudo scripts/install_system_packages.sh sapien")


def test_a_machine_without_vulkan_drivers_trains_without_videos():
    pytest.importorskip("sapien")
    finding = doctor.vulkan({**os.environ, "VK_DRIVER_FILES": "/nowhere", "VK_ICD_FILENAMES": "/nowhere"})
    assert finding.ok == "warning"
    assert finding.value.endswith("ManiSkill trains here all the same, without videos")


def test_a_machine_without_ffmpeg_or_git_only_warns(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", shim(tmp_path, "imageio_ffmpeg", "raise ImportError('no ffmpeg')"))
    assert doctor.git() == ("git", "warning", "not found", "sudo apt-get install git")
    assert doctor.ffmpeg() == (
        "ffmpeg",
        "warning",
        "ImportError: no ffmpeg",
        "pip install 'hcpg-flow[video]'",
    )


def test_the_doctor_itself_loads_nothing_heavy():
    code = "import sys, hcpg.loops.doctor; print(*{'jax', 'mujoco', 'numpy'} & set(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == []
