"""An exported policy, ready to act: network, scene reader and selector."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from hcpg import registry
from hcpg.interfaces import ReadScene
from hcpg.loops.control.choosing import Propose
from hcpg.loops.control.deployed.actors import Actor, actor_of
from hcpg.loops.control.deployed.parcel import AGAIN, Parcel, PolicyFolderError, read
from hcpg.registry import UnknownNameError
from hcpg.selection import Selector, select
from hcpg.types import Float, Tensor

TOLERANCE = 1e-5
"""Furthest that an action may be from the one that the trained network gave for the same noise."""
PROBE = ("probe.observation", "probe.noise", "probe.actions")
"""What the trained network did once; a policy is loaded only if it does the same here."""
FACTS = ("task", "adapter", "selector", "observation_size", "action_size", "network")
"""What `policy.json` has to say."""


class Policy:
    """A policy at a robot's side; in float64, so that it differs from training by training's rounding alone.

    Every random number comes from the generator that a call is given.
    """

    def __init__(self, parcel: Parcel, actor: Actor, selector: Selector, read_scene: ReadScene) -> None:
        """Use `load`."""
        self._actor, self._read_scene = actor, read_scene
        self.facts, self.digest, self.selector = parcel.facts, parcel.digest, selector
        self.task, self.adapter = str(parcel.facts["task"]), str(parcel.facts["adapter"])
        self.observation_size = int(parcel.facts["observation_size"])
        self.action_size = int(parcel.facts["action_size"])
        observation, noise, actions = (parcel.arrays[name] for name in PROBE)
        self.probe = observation
        """An observation of the training."""
        self.deviation = float(np.abs(self.actions(observation, noise) - actions).max())
        """Furthest from what the trained network did for the same noise, in units of the action."""

    @classmethod
    def load(cls, folder: Path | str, digest: str | None = None) -> "Policy":
        """The policy in `folder`, checked byte by byte; given a `digest`, that policy and no other.

        It is put to the test before it is handed out: on the noise that was stored with it, it has to do what
        the trained network did. Nothing of the folder is executed.

        Raises:
            PolicyFolderError: the folder is damaged or of another version, or what it holds acts differently.
            UnknownNameError: this version has no such task or adapter.
        """
        parcel = read(Path(folder), digest)
        _refuse_incomplete(parcel)
        task, adapter = registry.task(parcel.facts["task"]), parcel.facts["adapter"]
        if adapter not in task.adapters:
            raise UnknownNameError("adapter", adapter, sorted(task.adapters))
        actor = actor_of(parcel.facts["network"], parcel.arrays)
        policy = cls(parcel, actor, selector_from(parcel.facts["selector"]), task.adapters[adapter])
        if not policy.deviation <= TOLERANCE:  # also where it is NaN
            raise PolicyFolderError(
                f"on this machine the policy in {folder} acts {policy.deviation:.1e} differently from the "
                f"trained one, more than {TOLERANCE}; look at its NumPy and BLAS before it moves anything"
            )
        return policy

    def actions(
        self, observation: Float[Tensor, " O"], noise: Float[Tensor, "D K A"]
    ) -> Float[np.ndarray, "K A"]:
        """The K actions in [-1, 1] that standard normal `noise` leads to: as training has them, to 1e-5.

        Raises:
            ValueError: the observation has another size.
        """
        found = self._actor.actions(self._checked(observation), np.asarray(noise, np.float64))
        return found.astype(np.float32)

    def propose(
        self, observation: Float[Tensor, " O"], count: int, rng: np.random.Generator
    ) -> Float[np.ndarray, "K A"]:
        """`count` candidate actions in [-1, 1], independent in all their noise.

        Raises:
            ValueError: the observation has another size.
        """
        shape = (self._actor.draws, count, self.action_size)
        return self.actions(observation, rng.standard_normal(shape, np.float32))

    def act(self, observation: Float[Tensor, " O"], rng: np.random.Generator) -> Float[np.ndarray, " A"]:
        """The action to execute: K proposals, the scene, the selector; alone, the method's own action.

        Raises:
            ValueError: the observation has another size, or a number that is not finite.
        """
        if self.selector.alone:
            noise = rng.standard_normal((self._actor.draws, 1, self.action_size), np.float32)
            return self._actor.own(self._checked(observation), noise).astype(np.float32)
        count = self.selector.candidates
        proposals = self.propose(observation, count, rng)
        lots = {"noise": rng.random(count, np.float32)} if self.selector.needs_noise else {}
        return select(proposals, self._read_scene(np.asarray(observation)), self.selector, **lots)[0]

    def proposer(self, seed: int) -> Propose:
        """For the control loop: each draw depends on the seed and the draw's count alone."""

        def propose(observation: Tensor, count: int, draw: int) -> np.ndarray:
            return self.propose(observation, count, np.random.default_rng([seed, draw]))

        return propose

    def _checked(self, observation: Tensor) -> Float[np.ndarray, " O"]:
        found = np.asarray(observation, np.float64)
        if found.shape != (self.observation_size,):
            wanted = f"({self.observation_size},), as {self.task} has it"
            raise ValueError(f"the observation has shape {found.shape}; the policy reads {wanted}")
        return found


def _refuse_incomplete(parcel: Parcel) -> None:
    missing = [name for name in FACTS if name not in parcel.facts]
    missing += [name for name in PROBE if name not in parcel.arrays]
    if missing:
        raise PolicyFolderError(f"the policy's folder does not say {', '.join(missing)}. {AGAIN}")


def selector_from(settings: Mapping[str, Any]) -> Selector:
    """The selector that `policy.json` has the settings of.

    Raises:
        PolicyFolderError: it has a setting that this version does not know.
    """
    unknown = sorted(set(settings) - {field.name for field in fields(Selector)})
    if unknown:
        raise PolicyFolderError(f"the selector has unknown settings: {', '.join(unknown)}. {AGAIN}")
    plain: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in settings.items()
    }
    return Selector(**plain)
