"""What this machine offers to HCPG-Flow: one finding per line, each failure with its cure.

Nothing heavy is imported here: JAX and the simulators are tried in processes of their own, so that a driver
that crashes or hangs becomes a finding.
"""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import distributions, metadata, requires
from pathlib import Path
from typing import Literal, NamedTuple

import psutil
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_DISK_NEEDED_GB = 4
_MEMORY_NEEDED_GB = 2
_SHARED_MEMORY_NEEDED_MB = 64
_PROBE_TIMEOUT_S = 120
_DISTRIBUTION = "hcpg-flow"
_NEEDED_EXTRAS = ("", "train")
_UNNEEDED_EXTRAS = ("cuda12", "cuda13", "test", "lint", "bench")
_FLAGS = (
    "JAX_PLATFORMS",
    "XLA_FLAGS",
    "XLA_PYTHON_CLIENT_PREALLOCATE",
    "XLA_PYTHON_CLIENT_MEM_FRACTION",
    "OMP_NUM_THREADS",
)

_JAX_PROBE = """
import jax
print(jax.default_backend(), *{device.device_kind for device in jax.devices()})
"""

_RENDERING_PROBE = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><light/><geom size='1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    brightest = renderer.render().max()
if brightest == 0:
    raise RuntimeError("the picture is black")
print("draws without a display")
"""

# As ManiSkill chooses it: a GPU that computes, else the processor, through Mesa. It imports OpenCV, too.
_VULKAN_PROBE = """
import warnings
warnings.simplefilter("ignore")
import cv2, sapien
try:
    device = sapien.Device("cuda")
except RuntimeError:
    device = sapien.Device("cpu")
try:
    sapien.render.RenderSystem(device)
except RuntimeError as error:
    print("none:", error)
else:
    name = sapien.render.get_device_summary().partition("GPU: ")[2].partition(chr(10))[0]
    print("GPU:" if device.is_cuda() else "processor:", name)
"""

_FFMPEG_PROBE = """
import imageio_ffmpeg
print(imageio_ffmpeg.get_ffmpeg_version(), imageio_ffmpeg.get_ffmpeg_exe())
"""


class Finding(NamedTuple):
    """One thing that was looked at."""

    name: str
    ok: bool | Literal["warning"]
    """`warning`: training works, but something else does not."""
    value: str
    """What was found."""
    cure: str = ""
    """What to do about it; empty where `ok` is True."""


class Answer(NamedTuple):
    """What a probe in a process of its own came to."""

    ok: bool
    line: str
    """Its last line, or the first error that it reported."""


def examine() -> list[Finding]:
    """Everything that training, videos and reports need, looked at on this machine now."""
    return [
        python_version(),
        free_disk(),
        memory_and_cores(),
        shared_memory(),
        *packages(),
        jax_device(),
        jax_flags(os.environ),
        rendering(),
        vulkan(),
        ffmpeg(),
        git(),
    ]


def python_version(found: tuple[int, ...] = sys.version_info[:3]) -> Finding:
    """Whether Python is one of the versions that every package has a build for."""
    ok = (3, 11) <= found < (3, 14)
    cure = "Install Python 3.11, 3.12 or 3.13, then: make install PYTHON=python3.11"
    return _finding("python", ok, f"{'.'.join(map(str, found))} ({platform.machine()})", cure)


def free_disk(folder: Path = Path()) -> Finding:
    """The free space, in GB, of the disk that `folder` is on, where the run folders go."""
    free_gb = shutil.disk_usage(folder).free / 1e9
    cure = f"Free {_DISK_NEEDED_GB} GB, or make runs/ a link to a folder on another disk."
    value = f"{free_gb:.1f} GB free in {folder.resolve()}"
    return _finding("disk", free_gb >= _DISK_NEEDED_GB or "warning", value, cure)


def memory_and_cores() -> Finding:
    """The free memory, in GB, and the number of cores that this process may use."""
    free_gb = psutil.virtual_memory().available / 1e9
    cure = f"Close other programs: the demo needs {_MEMORY_NEEDED_GB} GB."
    value = f"{free_gb:.1f} GB free, {len(os.sched_getaffinity(0))} cores"
    return _finding("memory", free_gb >= _MEMORY_NEEDED_GB or "warning", value, cure)


def shared_memory(folder: Path = Path("/dev/shm")) -> Finding:
    """The free shared memory, in MB, through which environment workers hand over observations."""
    if not folder.is_dir():
        return _finding("shared memory", False, f"no {folder}", f"sudo mount -t tmpfs tmpfs {folder}")
    free_mb = shutil.disk_usage(folder).free / 1e6
    cure = f"Free {_SHARED_MEMORY_NEEDED_MB} MB of it; in a container: docker run --shm-size=1g"
    return _finding(
        "shared memory", free_mb >= _SHARED_MEMORY_NEEDED_MB, f"{free_mb:.0f} MB free in {folder}", cure
    )


def packages() -> list[Finding]:
    """Each package that the project asks for, and whether the installed version is within its bounds.

    One that only videos, plots or a simulator need is a warning where it is missing. The extras of
    developers and of accelerators are left out.
    """
    installed = {canonicalize_name(found.name): found.version for found in distributions()}
    if _DISTRIBUTION not in installed:
        return [_finding(_DISTRIBUTION, False, "not installed", "pip install -e . (or make install)")]
    return [_package(need, extra, installed.get(canonicalize_name(need.name))) for need, extra in _needs()]


def jax_device() -> Finding:
    """The device that JAX computes on."""
    answer = _probe(_JAX_PROBE)
    cure = (
        "pip install 'hcpg-flow[train]', for an NVIDIA GPU 'hcpg-flow[cuda13]' or [cuda12]; "
        "to compute on the CPU: export JAX_PLATFORMS=cpu"
    )
    return _finding("jax device", answer.ok, answer.line, cure)


def jax_flags(environment: Mapping[str, str]) -> Finding:
    """The memory and thread settings for JAX that `environment` holds."""
    value = " ".join(f"{name}={environment[name]}" for name in _FLAGS if name in environment)
    fraction = environment.get("XLA_PYTHON_CLIENT_MEM_FRACTION", "0.75")
    preallocate = environment.get("XLA_PYTHON_CLIENT_PREALLOCATE", "true").lower()
    cure = (
        "export XLA_PYTHON_CLIENT_MEM_FRACTION=0.5 (of the GPU's memory, above 0, at most 1), "
        "XLA_PYTHON_CLIENT_PREALLOCATE=false (or true)"
    )
    ok = bool(re.fullmatch(r"0?\.0*[1-9]\d*|1(\.0*)?", fraction)) and preallocate in (
        "true",
        "false",
        "1",
        "0",
    )
    return _finding(
        "jax flags", ok, value or "none set: on a GPU, JAX takes 75 % of its memory at once", cure
    )


def rendering(environment: Mapping[str, str] = os.environ) -> Finding:
    """Whether MuJoCo draws a picture without a display, under `environment`."""
    backend = environment.get("MUJOCO_GL") or "egl"
    answer = _probe(_RENDERING_PROBE, {**environment, "MUJOCO_GL": backend})
    cure = "sudo scripts/install_system_packages.sh, or: sudo apt-get install libegl1 libgl1-mesa-dri"
    cure += "" if backend == "egl" else "; then: unset MUJOCO_GL"
    return _finding("rendering", answer.ok or "warning", f"MUJOCO_GL={backend}: {answer.line}", cure)


def vulkan(environment: Mapping[str, str] = os.environ) -> Finding:
    """What SAPIEN, the simulator of ManiSkill, draws on: a GPU, the processor, or nothing."""
    answer = _probe(_VULKAN_PROBE, environment)
    if not answer.ok:
        cure = "make install, or look above at sapien; then: sudo scripts/install_system_packages.sh sapien"
        return _finding("vulkan", "warning", f"ManiSkill cannot start: {answer.line}", cure)
    draws = not answer.line.startswith("none:")
    value = answer.line if draws else f"{answer.line}. ManiSkill trains here all the same, without videos"
    cure = "For videos: sudo scripts/install_system_packages.sh vulkan (Mesa 24 or newer), or a GPU's driver"
    return _finding("vulkan", draws or "warning", value, cure)


def ffmpeg() -> Finding:
    """The ffmpeg that writes videos."""
    answer = _probe(_FFMPEG_PROBE)
    return _finding("ffmpeg", answer.ok or "warning", answer.line, "pip install 'hcpg-flow[video]'")


def git() -> Finding:
    """Whether git is there, which tells a run's manifest the commit."""
    program = shutil.which("git")
    return _finding(
        "git", program is not None or "warning", program or "not found", "sudo apt-get install git"
    )


def _finding(name: str, ok: bool | Literal["warning"], value: str, cure: str) -> Finding:
    return Finding(name, ok, value, "" if ok is True else cure)


def _needs() -> list[tuple[Requirement, str]]:
    """Each requirement of the project that a user may need, once, with the extra that asks for it."""
    extras = ["", *(metadata(_DISTRIBUTION).get_all("Provides-Extra") or ())]
    wanted = [extra for extra in extras if extra not in _UNNEEDED_EXTRAS]
    found: dict[str, tuple[Requirement, str]] = {}
    for extra in wanted:
        for need in map(Requirement, requires(_DISTRIBUTION) or ()):
            applies = need.marker is None or need.marker.evaluate({"extra": extra})
            if applies and need.name != _DISTRIBUTION:
                found.setdefault(need.name, (need, extra))
    return list(found.values())


def _package(need: Requirement, extra: str, version: str | None) -> Finding:
    cure = f"make install, or: pip install '{_DISTRIBUTION}{f'[{extra}]' if extra else ''}'"
    if version is None:
        return _finding(need.name, extra not in _NEEDED_EXTRAS and "warning", "not installed", cure)
    within = need.specifier.contains(version, prereleases=True)
    return _finding(need.name, within, f"{version} (asked for: {need.specifier})", cure)


def _probe(code: str, environment: Mapping[str, str] = os.environ) -> Answer:
    """What `code` says in a Python process of its own; a hang or a crash is an answer too."""
    command = [sys.executable, "-c", code]
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=_PROBE_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return Answer(False, f"no answer within {_PROBE_TIMEOUT_S} s")
    if done.returncode == 0:
        return Answer(True, done.stdout.strip().splitlines()[-1])
    errors = re.findall(r"^[\w.]*Error\b.*$", done.stderr, re.MULTILINE)
    return Answer(False, errors[0] if errors else f"the process ended with {done.returncode}")
