"""ManiSkill's own environment, built without its Gymnasium wrappers, for a machine with or without Vulkan."""

import importlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_MODULES_WITH_COLOURS = ("sapien.render", "sapien.pysapien.render")
"""SAPIEN's own builders and ManiSkill's look the class up in one each."""


def build_simulation(env_id: str, control_mode: str) -> Any:
    """One of ManiSkill's environments on the processor, which draws nothing and asks for no Vulkan device.

    Args:
        env_id: ManiSkill's name of the task.
        control_mode: ManiSkill's name of what an action means.
    """
    with _no_colours():
        return _build(env_id, control_mode, render_backend="none")


def build_stage(env_id: str, control_mode: str) -> Any:
    """The same environment with everything visible in it, drawn on the GPU where there is one.

    Raises:
        RuntimeError: there is no Vulkan device, or SAPIEN refuses the one there is.
    """
    return _build(env_id, control_mode, render_backend="gpu", render_mode="rgb_array")


def _build(env_id: str, control_mode: str, **rendering: str) -> Any:
    environment_class = _environment_class(env_id)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the package's own use of logging and NumPy
        return environment_class(
            num_envs=1,
            obs_mode="state",
            reward_mode="normalized_dense",
            control_mode=control_mode,
            sim_backend="physx_cpu",
            **rendering,
        )


def _environment_class(env_id: str) -> Any:
    with warnings.catch_warnings():
        # SAPIEN says that it falls back to its own Vulkan loader: nothing here needs one.
        warnings.simplefilter("ignore")
        importlib.import_module("mani_skill.envs")
        registration: Any = importlib.import_module("mani_skill.utils.registration")
    return registration.REGISTERED_ENVS[env_id].cls


@contextmanager
def _no_colours() -> Iterator[None]:
    """Let a scene be built without a renderer.

    ManiSkill leaves everything visible out of such a scene, but makes the colours of it first, and SAPIEN
    asks for a Vulkan device to make one. Nothing reads these colours.
    """
    modules: list[Any] = [importlib.import_module(name) for name in _MODULES_WITH_COLOURS]
    stock = modules[0].RenderMaterial
    for module in modules:
        module.RenderMaterial = _Nothing
    try:
        yield
    finally:
        for module in modules:
            module.RenderMaterial = stock


class _Nothing:
    """Stands in for a colour of something that is not drawn."""

    def __init__(self, base_color: object = None) -> None: ...
