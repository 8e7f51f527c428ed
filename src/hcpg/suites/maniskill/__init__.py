"""ManiSkill: tasks of a Panda arm in SAPIEN (PhysX), with state observations and end-effector control.

Traps of the package that end here. An unseeded reset draws from PyTorch's global generator, so every reset
has a seed. A reset leaves the last episode's contacts in the physics engine, so every episode gets an engine
of its own: without it the flag `is_grasped` is wrong at first, and an episode depends on the one before. A
success ends an episode, which would make it worth less than being close to one, so nothing terminates here.
"""

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hcpg.interfaces import Environment, EnvironmentBatch, Task
from hcpg.suites.maniskill.batch import Address, ManiskillBatch
from hcpg.suites.maniskill.building import build_simulation, renew_physics
from hcpg.suites.maniskill.numpy_stepping import NumpyStepping
from hcpg.suites.maniskill.pictures import Camera
from hcpg.suites.maniskill.stepping import Stepping, TorchStepping
from hcpg.types import Float, Spec, Step, UInt8

OBSERVATION_SIZES = {"PickCube-v1": 42, "PushCube-v1": 35, "PullCube-v1": 35, "PokeCube-v1": 54}
ACTION_SIZES = {"pd_ee_delta_pos": 4, "pd_ee_delta_pose": 7}
"""By control mode; the last number is the gripper's: 1 opens, -1 closes."""
START_STATES = 4096
"""Start states of one seed. ManiSkill's own seeds have 32 bits, and sets of different seeds are disjoint."""
LARGEST_SEED = 2**32 // START_STATES - 1


class ManiskillEnvironment:
    """One ManiSkill task; the reward is ManiSkill's normalised dense one, at most 1 per step."""

    def __init__(self, task: Task, seed: int, stepping: Stepping) -> None:
        self._task, self._seed, self._stepping = task, seed, stepping
        self._camera: Camera | None = None
        self._action_size = ACTION_SIZES[control_mode(task)]

    def reset(self, start: int) -> Float[np.ndarray, " O"]:
        """The first observation of start state `start % 4096`; of what was before, nothing is left."""
        renew_physics(self._stepping.simulation)
        return self._stepping.reset(self._seed * START_STATES + start % START_STATES)

    def step(self, action: Float[np.ndarray, " A"]) -> Step:
        """The answer to one action; success means "now", and the episode goes on after it.

        Raises:
            ValueError: the action is not as many finite numbers as the control mode takes.
        """
        if action.shape != (self._action_size,) or not math.isfinite(action.sum()):
            raise ValueError(
                f"an action of this task is {self._action_size} finite numbers in [-1, 1], got {action}"
            )
        observation, reward, success = self._stepping.step(action)
        return Step(observation, reward, False, success)

    def render(self) -> UInt8[np.ndarray, "H W 3"]:
        """The table seen from its free side; the simulation that learns is not touched by it.

        Raises:
            RenderingError: this machine has no Vulkan device that SAPIEN can draw with.
        """
        if self._camera is None:
            self._camera = Camera(self._task.env_id, control_mode(self._task))
        return self._camera.picture(self._stepping.simulation)

    def close(self) -> None:
        """Free the simulation and, where one was opened, the camera; safe to call twice."""
        self._stepping.close()
        if self._camera is not None:
            self._camera.close()
            self._camera = None


@dataclass(frozen=True)
class ManiskillSuite:
    """The suite of ManiSkill's tasks."""

    stepping: Literal["numpy", "torch"] = "numpy"
    """Whose arithmetic makes a step, ours or ManiSkill's own; physics and numbers are the same."""
    batch_backend: Literal["physx_cuda", "physx_cpu"] = "physx_cuda"
    """What simulates a batch; the processor takes a batch of one, for tests."""

    def spec(self, task: Task) -> Spec:
        """The sizes of the task's observation and of its control mode's action."""
        return Spec(_known("task", task.env_id, OBSERVATION_SIZES), ACTION_SIZES[control_mode(task)])

    def make(self, task: Task, seed: int) -> Environment:
        """An environment with the 4,096 start states that `seed` names; it needs no Vulkan device.

        Raises:
            ValueError: there is no such task or control mode here, or the seed is not in [0, 2**20).
        """
        _check_seed(seed)
        self.spec(task)
        simulation = build_simulation(task.env_id, control_mode(task))
        numpy = self.stepping == "numpy"
        stepping = NumpyStepping(simulation, task.env_id) if numpy else TorchStepping(simulation)
        return ManiskillEnvironment(task, seed, stepping)

    def make_batch(self, task: Task, seeds: Sequence[int]) -> EnvironmentBatch:
        """An environment for each seed, simulated together on a GPU.

        Raises:
            ValueError: as `make` does.
        """
        for seed in seeds:
            _check_seed(seed)
        self.spec(task)
        address = Address(task.env_id, control_mode(task), self.batch_backend)
        return ManiskillBatch(address, [seed * START_STATES for seed in seeds], START_STATES)


SUITE = ManiskillSuite()


def control_mode(task: Task) -> str:
    """ManiSkill's name of the task's control mode, which its `control` begins with.

    Raises:
        ValueError: it is none of those that this suite knows.
    """
    mode = task.control.partition(":")[0]
    _known("control mode", mode, ACTION_SIZES)
    return mode


def _check_seed(seed: int) -> None:
    if not 0 <= seed <= LARGEST_SEED:
        raise ValueError(f"a seed of maniskill is an integer in [0, {LARGEST_SEED}], got {seed}")


def _known(kind: str, name: str, table: dict[str, int]) -> Any:
    if name not in table:
        near = difflib.get_close_matches(name, table, n=1)
        guess = f" Did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"maniskill has no {kind} {name!r} here.{guess} It has: {', '.join(table)}.")
    return table[name]
