"""Classical twin critics: plain networks with exponentially averaged targets, nothing normalised."""

from typing import NamedTuple

import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from hcpg.networks.critics import CriticState, Target, Values, bellman_target, regression
from hcpg.networks.descent import follow
from hcpg.networks.mlp import MLP, ensemble, evaluate
from hcpg.types import Batch


class Plain(NamedTuple):
    """ReLU critics on the raw observation and action, with target networks.

    Source: Haarnoja et al. 2018, "Soft Actor-Critic Algorithms and Applications", equation (5); the smaller
    of two critics after Fujimoto et al. 2018.
    """

    hidden_sizes: tuple[int, ...]
    critics: int = 2
    target_rate: float = 0.005

    def init(self, key: PRNGKeyArray, inputs: int) -> CriticState:
        """N critics, and targets equal to them; no statistics."""
        sizes = (inputs, *self.hidden_sizes, 1)
        networks = ensemble(lambda each: MLP.create(each, sizes), key, self.critics)
        return CriticState(networks, (), jax.tree.map(jnp.copy, networks))

    def loss(
        self, networks: PyTree, state: CriticState, batch: Batch, following: Target
    ) -> tuple[Float[Array, ""], tuple[CriticState, Values]]:
        """Regression on the targets' values of the next step."""
        now = jnp.concatenate([batch.observations, batch.actions], axis=-1)
        then = jnp.concatenate([batch.next_observations, following.actions], axis=-1)
        values = evaluate(networks, now)[..., 0]
        target = bellman_target(batch, evaluate(state.target, then)[..., 0], following)
        return regression(values, target), (state, values)

    def values(self, state: CriticState, inputs: Float[Array, "B I"]) -> Values:
        """Values of the online critics."""
        return evaluate(state.networks, inputs)[..., 0]

    def follow(self, state: CriticState) -> CriticState:
        """Targets moved by `target_rate` towards the online critics."""
        return state._replace(target=follow(state.target, state.networks, self.target_rate))
