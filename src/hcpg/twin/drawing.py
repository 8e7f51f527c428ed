"""Pictures of a scene, drawn without a display; OpenGL is loaded when the first one is asked for."""

import importlib
import os
from typing import Any

import numpy as np

from hcpg.types import UInt8

CAMERA = "side"
MOST_GEOMS = 300
BACKENDS = ("egl", "osmesa")


class DrawingError(RuntimeError):
    """No picture can be drawn on this machine; the message names what to install."""


class Drawing:
    """Draws one model's states, `pixels` square; MUJOCO_GL chooses between egl (the default) and osmesa."""

    def __init__(self, model: Any, pixels: int) -> None:
        """Open an off-screen context.

        Raises:
            DrawingError: a library for OpenGL is missing.
        """
        self._mujoco: Any = importlib.import_module("mujoco")
        self._model, self._view = model, self._mujoco.MjrRect(0, 0, pixels, pixels)
        self._context = _open(pixels)
        self._context.make_current()
        self._scene = self._mujoco.MjvScene(model, MOST_GEOMS)
        self._painter = self._mujoco.MjrContext(model, self._mujoco.mjtFontScale.mjFONTSCALE_100.value)
        self._mujoco.mjr_setBuffer(self._mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._painter)
        self._camera = self._mujoco.MjvCamera()
        self._camera.type = self._mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(CAMERA).id
        self._options = self._mujoco.MjvOption()

    def picture(self, data: Any) -> UInt8[np.ndarray, "H W 3"]:
        """The scene from the side, the arm to the left."""
        self._context.make_current()
        everything = self._mujoco.mjtCatBit.mjCAT_ALL.value
        self._mujoco.mjv_updateScene(
            self._model, data, self._options, None, self._camera, everything, self._scene
        )
        self._mujoco.mjr_render(self._view, self._scene, self._painter)
        pixels = np.empty((self._view.height, self._view.width, 3), np.uint8)
        self._mujoco.mjr_readPixels(pixels, None, self._view, self._painter)
        return pixels[::-1].copy()

    def close(self) -> None:
        """Free the context; safe to call twice."""
        if self._painter is not None:
            self._context.make_current()
            self._painter.free()
            self._context.free()
            self._painter = None


def _open(pixels: int) -> Any:
    backend = os.environ.get("MUJOCO_GL") or "egl"
    cure = "Debian, Ubuntu: run scripts/install_system_packages.sh; training needs no OpenGL"
    if backend not in BACKENDS:
        raise DrawingError(
            f"MUJOCO_GL={backend} needs a display; set it to {' or '.join(BACKENDS)}, or unset it"
        )
    try:
        return importlib.import_module(f"mujoco.{backend}").GLContext(pixels, pixels)
    except (ImportError, AttributeError, RuntimeError) as error:
        raise DrawingError(f"cannot draw with OpenGL (MUJOCO_GL={backend}): {error}. {cure}") from error
