"""ManiSkill's own environment, built without its Gymnasium wrappers, for a machine with or without Vulkan."""

import importlib
import logging
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

_MODULES_WITH_COLOURS = ("sapien.render", "sapien.pysapien.render")
"""SAPIEN's own builders and ManiSkill's look the class up in one each."""
_DRAWING: dict[str, Any] = {
    "render_backend": "gpu",  # ManiSkill itself falls back to the processor
    "render_mode": "rgb_array",
    # A third of the others' time to the first picture where the processor draws, and no worse to look at.
    "human_render_camera_configs": {"shader_pack": "minimal"},
}


def build_simulation(env_id: str, control_mode: str) -> Any:
    """One of ManiSkill's environments on the processor, which draws nothing and asks for no Vulkan device.

    Args:
        env_id: ManiSkill's name of the task.
        control_mode: ManiSkill's name of what an action means.
    """
    return _build(env_id, control_mode, _no_colours(), render_backend="none")


def build_stage(env_id: str, control_mode: str) -> Any:
    """The same environment with everything visible in it, drawn on the GPU where there is one.

    Raises:
        RuntimeError: there is no Vulkan device, or SAPIEN refuses the one there is.
    """
    return _build(env_id, control_mode, nullcontext(), **_DRAWING)


def build_batch(env_id: str, control_mode: str, backend: str, size: int) -> Any:
    """One of ManiSkill's environments for `size` scenes at once, which draws nothing.

    Args:
        env_id: ManiSkill's name of the task.
        control_mode: ManiSkill's name of what an action means.
        backend: ManiSkill's name of what simulates, `physx_cuda` or `physx_cpu`.
        size: how many scenes.

    Raises:
        RuntimeError: the backend is the processor's, which takes one scene, and `size` is more.
    """
    rest = {"num_envs": size, "sim_backend": backend, "render_backend": "none"}
    return _build(env_id, control_mode, _no_colours(), **rest)


def renew_physics(simulation: Any) -> None:
    """Put all bodies of a simulation that draws nothing into a new scene of the physics engine.

    A reset by ManiSkill moves the bodies back into the old one, where the order in which contacts are solved
    follows from the last episode: once bodies touch, the same start and actions then lead elsewhere. A body
    also takes along how long it will stay awake, which is longer after a hit: it is woken, as if it were new.
    """
    sapien: Any = importlib.import_module("sapien")
    scene, old = simulation.scene, simulation.scene.sub_scenes[0]
    simulation._set_scene_config()  # the engine's own settings are global, and read when a scene is made
    physics = sapien.physx.PhysxCpuSystem()
    physics.timestep = scene.px.timestep
    entities, new = list(old.entities), sapien.Scene([physics])
    for entity in entities:
        for part in entity.components:
            if isinstance(part, sapien.physx.PhysxRigidDynamicComponent) and not part.kinematic:
                part.wake_up()
        old.remove_entity(entity)
    for entity in entities:
        new.add_entity(entity)
    scene.sub_scenes[0], scene.px = new, physics


def _build(env_id: str, control_mode: str, building: AbstractContextManager, **rest: Any) -> Any:
    with warnings.catch_warnings(), _only_errors_logged():
        warnings.simplefilter("ignore")  # of the package's own use of logging, NumPy and the Vulkan loader
        importlib.import_module("mani_skill.envs")
        registration: Any = importlib.import_module("mani_skill.utils.registration")
        environment_class = registration.REGISTERED_ENVS[env_id].cls
        with building:
            return environment_class(
                obs_mode="state",
                reward_mode="normalized_dense",
                control_mode=control_mode,
                **({"num_envs": 1, "sim_backend": "physx_cpu"} | rest),
            )


@contextmanager
def _only_errors_logged() -> Iterator[None]:
    """Keep to itself that a disc has no initial pose, and that without a GPU the processor draws."""
    logger = logging.getLogger("mani_skill ")  # the space is in its name
    logger.addFilter(_is_error)
    try:
        yield
    finally:
        logger.removeFilter(_is_error)


def _is_error(record: logging.LogRecord) -> bool:
    return record.levelno >= logging.ERROR


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
