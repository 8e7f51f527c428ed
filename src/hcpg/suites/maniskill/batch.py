"""Hundreds of ManiSkill's environments in one simulation on a GPU; observations go to JAX where they lie.

Start states are those that the same seeds name on a processor: one simulation there draws each of them once,
and the batch is put into it. (ManiSkill's own batched reset draws all from the first seed, so that what one
environment starts from would depend on how many others there are.)
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hcpg.suites.maniskill.building import build_batch, build_simulation, renew_physics
from hcpg.types import Bool, Float, Int, Tensor

TORCH_SHARE = 0.1
"""The part of the GPU's memory that PyTorch may take. JAX takes 0.75 (XLA_PYTHON_CLIENT_MEM_FRACTION), PhysX
the rest."""
IS_GRASPED = {"PickCube-v1": 18}
"""Where an observation holds a flag that follows from contacts, which outlive a reset: it is set to 0."""


class Address(NamedTuple):
    """What is simulated, and where."""

    env_id: str
    control_mode: str
    backend: str = "physx_cuda"
    """ManiSkill's name of what simulates; its `physx_cpu` takes one environment alone."""


class ManiskillBatch:
    """N environments of one task that one call steps; arrays are JAX's, on the device that simulates."""

    def __init__(self, address: Address, first_seeds: Sequence[int], start_states: int) -> None:
        """Build the simulations.

        Args:
            address: what is simulated, and where.
            first_seeds: ManiSkill's seed of each environment's start state 0; the others' follow it.
            start_states: how many an environment has.
        """
        self._first_seeds, self._start_states = np.asarray(first_seeds, np.int64), start_states
        self._is_grasped = IS_GRASPED.get(address.env_id)
        self._drawer = build_simulation(address.env_id, address.control_mode)
        self._states: dict[int, dict[str, Any]] = {}
        if address.backend != "physx_cpu":
            _limit_torch()
        self._simulation = build_batch(*address, len(first_seeds))

    def reset(self, starts: Int[Tensor, " N"]) -> Float[Tensor, "N O"]:
        """The first observations of the given start states, which wrap around."""
        seeds = self._first_seeds + np.asarray(starts) % self._start_states
        states = [self._start_state(int(seed)) for seed in seeds]
        options = {"reset_to_env_states": {"env_states": _stacked(states)}}
        observations, _ = self._simulation.reset(options=options)
        if self._is_grasped is not None:
            observations[:, self._is_grasped] = 0.0
        return _to_jax(observations)

    def step(
        self, actions: Float[Tensor, "N A"]
    ) -> tuple[Float[Tensor, "N O"], Float[Tensor, " N"], Bool[Tensor, " N"]]:
        """Observations, normalised dense rewards and successes after one action each."""
        import torch

        told = torch.as_tensor(np.asarray(actions), device=self._simulation.device)
        observations, rewards, _, _, info = self._simulation.step(told)
        return _to_jax(observations), _to_jax(rewards), _to_jax(info["success"])

    def close(self) -> None:
        """Free both simulations; safe to call twice."""
        self._drawer.close()
        self._simulation.close()

    def _start_state(self, seed: int) -> dict[str, Any]:
        """Where everything is at the beginning of ManiSkill's episode `seed`; drawn once."""
        if seed not in self._states:
            renew_physics(self._drawer)
            self._drawer.reset(seed=seed)
            self._states[seed] = self._drawer.get_state_dict()
        return self._states[seed]


def _stacked(states: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The states of N environments of one, as the state of one of N."""
    import torch

    kinds = ("actors", "articulations")
    return {
        kind: {name: torch.cat([state[kind][name] for state in states]) for name in states[0][kind]}
        for kind in kinds
    }


def _to_jax(tensor: Any) -> Tensor:
    """The tensor as an array of JAX over the same memory; nobody may write into it any more."""
    from jax import dlpack

    return dlpack.from_dlpack(tensor.contiguous())


def _limit_torch() -> None:
    import torch

    torch.cuda.set_per_process_memory_fraction(TORCH_SHARE)
