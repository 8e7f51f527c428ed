"""What SAC-Flow's actor learns in addition where it shall stay near the batch's actions: cloning's loss."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from one_update import transitions

from hcpg.methods.sac_flow import Config, SACFlow
from hcpg.networks.flow import Noise
from hcpg.networks.matching import DEVIATION, bridge, matching_loss
from hcpg.types import Spec

TINY = Config(actor_hidden_size=8, critic_hidden_size=8, critic="polyak", flow_steps=2)
WEIGHT = 3.0


@pytest.fixture(scope="module")
def losses():
    """The actor's loss without and with imitation, and cloning's own loss of the same batch and noise."""
    batch, noise = transitions(8, 5, 3), Noise.draw(jax.random.key(1), (8, 3), TINY.flow_steps)
    methods = [SACFlow(replace(TINY, imitation=weight), Spec(5, 3)) for weight in (0.0, WEIGHT)]
    nudges = jnp.zeros((TINY.flow_steps + 1, 8, 3))

    @jax.jit
    def all_three(key):
        state = methods[0].init(key)
        both = [method._actor_loss(state.actor, nudges, state, batch, noise) for method in methods]
        ends = jnp.arctanh(jnp.clip(batch.actions, -0.98, 0.98))
        path = bridge(ends, noise, DEVIATION)
        cloning = matching_loss(state.actor, state.actor_moments, batch.observations, path, DEVIATION)
        return [loss for loss, _ in both], [moments for _, (_, moments) in both], cloning[0]

    return all_three(jax.random.key(0))


def test_it_is_the_weighted_loss_of_cloning(losses):
    (without, with_it), _, cloning = losses
    assert float(cloning) > 0.5
    assert float(with_it - without) == pytest.approx(WEIGHT * float(cloning), rel=1e-5)


def test_the_running_moments_are_those_of_the_actors_own_paths(losses):
    _, (without, with_it), _ = losses
    jax.tree.map(np.testing.assert_array_equal, without, with_it)
