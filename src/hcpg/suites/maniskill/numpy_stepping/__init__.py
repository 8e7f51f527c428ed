"""ManiSkill's steps with its own formulas in NumPy; ManiSkill computes them in PyTorch, on batches of one.

The scene, its physics and the search for joint positions are ManiSkill's and SAPIEN's. Here is only what
stands around them: from the action to the joints' targets, and from the bodies to observation, reward and
success. These formulas are those of one version, so the two packages must be of that version.
"""

from importlib.metadata import version
from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping.control import EndEffectorControl
from hcpg.suites.maniskill.numpy_stepping.pick_cube import PickCube
from hcpg.suites.maniskill.numpy_stepping.poke_cube import PokeCube
from hcpg.suites.maniskill.numpy_stepping.pull_cube import PullCube
from hcpg.suites.maniskill.numpy_stepping.push_cube import PushCube
from hcpg.types import Float

VERSIONS = {"mani-skill": "3.0.1", "sapien": "3.0.3"}
"""What the formulas here were taken from and are compared with."""
TASKS = {"PickCube-v1": PickCube, "PushCube-v1": PushCube, "PullCube-v1": PullCube, "PokeCube-v1": PokeCube}


class VersionError(RuntimeError):
    """Another version of a package is installed than the one whose formulas stand here."""

    def __init__(self, package: str, installed: str) -> None:
        wanted = VERSIONS[package]
        super().__init__(
            f"the NumPy stepping of maniskill repeats {package} {wanted}, but {installed} is installed. "
            f"Install {package}=={wanted}, or step in PyTorch: ManiskillSuite(stepping='torch')."
        )


class NumpyStepping:
    """One of ManiSkill's environments, stepped without its PyTorch arithmetic.

    Observation, reward and success are those of ManiSkill: poses and targets bit for bit, rewards to 1e-6.
    """

    def __init__(self, simulation: Any, env_id: str) -> None:
        """Bind to a simulation that ManiSkill has built.

        Raises:
            VersionError: ManiSkill or SAPIEN are of another version than this was written for.
        """
        require_versions()
        self.simulation = simulation
        self._control, self._task = EndEffectorControl(simulation), TASKS[env_id](simulation)
        self._scene, self._substeps = simulation.scene, simulation._sim_steps_per_control

    def reset(self, seed: int) -> Float[np.ndarray, " O"]:
        """The first observation; ManiSkill itself resets."""
        return self.simulation.reset(seed=seed)[0][0].numpy().copy()

    def step(self, action: Float[np.ndarray, " A"]) -> tuple[Float[np.ndarray, " O"], float, bool]:
        """Observation, normalised dense reward and success."""
        self._control.set_targets(action)
        physics = self._scene.px  # another one after each reset
        for _ in range(self._substeps):
            physics.step()
        return self._task.answer()

    def close(self) -> None:
        """Free the simulation; safe to call twice."""
        self.simulation.close()


def require_versions() -> None:
    """Check the installed packages.

    Raises:
        VersionError: one of them is not of the version in `VERSIONS`.
    """
    for package, wanted in VERSIONS.items():
        installed = version(package)
        if installed != wanted:
            raise VersionError(package, installed)
