"""Meta-World: tasks of a Sawyer arm in MuJoCo, with the goal in the observation.

Three traps of the package end here. `reset(seed=)` is ignored, so start states are set by hand. The declared
observation space has the goal at 0, so nothing reads it. Goals come from NumPy's global generator, so every
set of start states is drawn with a seed, after which that generator stands where it stood.
"""

import atexit
import ctypes
import difflib
import importlib
import math
import os
from functools import lru_cache
from typing import Any

import numpy as np

from hcpg.interfaces import Environment, Task
from hcpg.suites.metaworld.stepping import simulation_class
from hcpg.types import Float, RenderingError, Spec, Step, UInt8

OBSERVATION_SIZE, ACTION_SIZE = 39, 4
START_STATES = 50
"""Start states of one seed: what Meta-World's MT1 draws."""
LARGEST_SEED = 2**32 - 1
SCANS_CONTACTS_FOR_INFO_ONLY = frozenset(
    {
        "coffee-pull-v3",
        "coffee-push-v3",
        "hand-insert-v3",
        "pick-place-v3",
        "pick-place-wall-v3",
        "push-v3",
        "push-back-v3",
        "push-wall-v3",
        "shelf-place-v3",
        "soccer-v3",
        "sweep-v3",
        "sweep-into-v3",
    }
)
"""Tasks that scan all contacts in Python at every step, for an entry of `info` that nobody reads here.

Of the two others that scan, `stick-push` needs the answer for its success, and `stick-pull` is kept like it.
"""

PICTURE_PIXELS = 480
CAMERA = {"lookat": (0.0, 0.68, 0.15), "distance": 1.5, "azimuth": 140.0, "elevation": -30.0}
"""From the table's free side, above it; m and degrees. The package's own corner cameras are upside down."""
OPENGL_LIBRARIES = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
"""What each value of MUJOCO_GL that needs no display loads."""
OPENGL_PACKAGES = "libegl1 libgl1-mesa-dri"


class MetaworldEnvironment:
    """One Meta-World task with the goal visible and reward v2, 0 to 10 per step.

    All of a task in a process share one model: step them from one thread.
    """

    def __init__(self, env_id: str, seed: int) -> None:
        self._starts = _start_states(env_id, seed)
        self._simulation = _simulation_class(env_id)()
        self._places = self._simulation.shared.places()
        self._viewer: Any = None

    def reset(self, start: int) -> Float[np.ndarray, " O"]:
        """The first observation of start state `start % 50`, bit for bit the same every time."""
        shared = self._simulation.shared
        shared.put(self._places)
        self._simulation.set_task(self._starts[start % START_STATES])
        observation, _ = self._simulation.reset()
        self._places = shared.places()
        return observation.astype(np.float32)

    def step(self, action: Float[np.ndarray, " A"]) -> Step:
        """The answer to one action; success means "now", and the episode goes on after it.

        Raises:
            ValueError: the action is not four finite numbers, or it is the 501st since the reset.
        """
        if action.shape != (ACTION_SIZE,) or not math.isfinite(action.sum()):
            raise ValueError(f"an action of metaworld is four finite numbers in [-1, 1], got {action}")
        self._simulation.shared.put(self._places)
        observation, reward, _, _, info = self._simulation.step(action)
        return Step(observation.astype(np.float32), float(reward), False, bool(info["success"]))

    def render(self) -> UInt8[np.ndarray, "H W 3"]:
        """The table seen from its free side, upright; works without a display.

        Raises:
            RenderingError: a library for OpenGL is missing, or drawing with it fails.
        """
        if self._viewer is None:
            self._viewer = _open_viewer(self._simulation.model, self._simulation.data)
            # Left to the interpreter's end, a viewer outlives the library that it frees itself with.
            atexit.register(self.close)
        self._simulation.shared.put(self._places)
        self._viewer.make_context_current()
        return np.ascontiguousarray(self._viewer.render("rgb_array", camera_id=-1))

    def close(self) -> None:
        """Free the simulation and, where one was opened, the viewer; safe to call twice."""
        self._simulation.close()
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None
            atexit.unregister(self.close)


class MetaworldSuite:
    """The suite of Meta-World's tasks."""

    def spec(self, task: Task) -> Spec:
        """39 observed numbers, 4 commanded, for every task."""
        return Spec(OBSERVATION_SIZE, ACTION_SIZE)

    def make(self, task: Task, seed: int) -> Environment:
        """An environment with the 50 start states that `seed` draws.

        Raises:
            ValueError: Meta-World has no such task, or the seed is not in [0, 2**32).
            RenderingError: MUJOCO_GL is set to a library that this machine does not have.
        """
        if not 0 <= seed <= LARGEST_SEED:
            raise ValueError(f"a seed of metaworld is an integer in [0, {LARGEST_SEED}], got {seed}")
        known = _metaworld().ALL_V3_ENVIRONMENTS
        if task.env_id not in known:
            near = difflib.get_close_matches(task.env_id, known, n=1)
            guess = f" Did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"Meta-World has no task {task.env_id!r}.{guess} It has: {', '.join(known)}.")
        return MetaworldEnvironment(task.env_id, seed)


SUITE = MetaworldSuite()


def _metaworld() -> Any:
    """The package; it imports MuJoCo, which loads the OpenGL library that MUJOCO_GL names, if set."""
    _require_opengl_library(os.environ.get("MUJOCO_GL", ""))
    import metaworld

    return metaworld


@lru_cache(maxsize=64)  # drawing 50 starts takes most of a second; a process asks for few sets
def _start_states(env_id: str, seed: int) -> list[Any]:
    return _metaworld().MT1(env_id, seed=seed).train_tasks


def _simulation_class(env_id: str) -> Any:
    unread = {"touching_main_object": False} if env_id in SCANS_CONTACTS_FOR_INFO_ONLY else {}
    return simulation_class(_metaworld().ALL_V3_ENVIRONMENTS[env_id], **unread)


def _require_opengl_library(backend: str) -> None:
    if backend in OPENGL_LIBRARIES:
        try:
            ctypes.CDLL(OPENGL_LIBRARIES[backend])
        except OSError as error:
            raise _cannot_draw(backend, error) from error


def _open_viewer(model: Any, data: Any) -> Any:
    """An off-screen viewer; MUJOCO_GL decides how it draws, `egl` where it is not set."""
    backend = os.environ.get("MUJOCO_GL") or "egl"
    # Set no earlier: MuJoCo, imported under it, would need OpenGL for training too.
    os.environ["MUJOCO_GL"] = backend
    _require_opengl_library(backend)
    mujoco: Any = importlib.import_module("mujoco")
    from gymnasium.envs.mujoco.mujoco_rendering import OffScreenViewer

    try:
        viewer = OffScreenViewer(model, data, PICTURE_PIXELS, PICTURE_PIXELS)
    except (AttributeError, ImportError, RuntimeError, mujoco.FatalError) as error:
        raise _cannot_draw(backend, error) from error
    # Shadows cost more than half of a picture that the processor draws.
    viewer.scn.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
    viewer.cam.lookat[:] = CAMERA["lookat"]
    for angle_or_length in ("distance", "azimuth", "elevation"):
        setattr(viewer.cam, angle_or_length, CAMERA[angle_or_length])
    return viewer


def _cannot_draw(backend: str, cause: object) -> RenderingError:
    return RenderingError(
        f"cannot draw with OpenGL (MUJOCO_GL={backend}): {cause}. Debian, Ubuntu: run "
        f"scripts/install_system_packages.sh, or: sudo apt-get install {OPENGL_PACKAGES}; "
        "then draw with MUJOCO_GL=egl, the default. Training needs no OpenGL."
    )
