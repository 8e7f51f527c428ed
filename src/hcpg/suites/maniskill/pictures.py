"""Pictures of a simulation that has nothing to draw with: a second one, which has, is put into its state."""

from typing import Any

import numpy as np

from hcpg.suites.maniskill.building import build_stage
from hcpg.types import RenderingError, UInt8

CURE = (
    "Without a GPU it takes Mesa 24 or newer: run scripts/install_system_packages.sh vulkan "
    "(Debian, Ubuntu); `hcpg doctor` says what is there. Training needs no Vulkan."
)


class Camera:
    """A scene with everything visible in it, of which no physics is asked."""

    def __init__(self, env_id: str, control_mode: str) -> None:
        """Build the scene.

        Raises:
            RenderingError: there is no Vulkan device, or SAPIEN refuses the one there is.
        """
        try:
            self._stage = build_stage(env_id, control_mode)
        except RuntimeError as error:
            raise RenderingError(f"cannot draw with Vulkan: {error}. {CURE}") from error

    def picture(self, simulation: Any) -> UInt8[np.ndarray, "H W 3"]:
        """What ManiSkill's own camera for videos sees of the simulation's state."""
        self._stage.set_state_dict(simulation.get_state_dict())
        return self._stage.render_rgb_array()[0].cpu().numpy()

    def close(self) -> None:
        """Free the scene."""
        self._stage.close()
