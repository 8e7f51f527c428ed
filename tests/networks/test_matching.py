"""Flow matching in the actor's own space: end points and paths by hand."""

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.flow import Noise
from hcpg.networks.gated_actor import GatedActor
from hcpg.networks.matching import bridge, end_points, matching_loss


def test_paths_end_where_tanh_gives_the_action():
    ends = end_points(jnp.array([0.5, -0.5, 0.0, 1.0, -1.0]))
    assert ends.tolist() == pytest.approx([0.549306, -0.549306, 0.0, 2.297560, -2.297560], abs=1e-5)
    assert np.tanh(ends).tolist() == pytest.approx([0.5, -0.5, 0.0, 0.98, -0.98], abs=1e-6)


def test_a_path_by_hand():
    # Half of the way from 1 to 3 in the first step, and 0.1 of noise; then what is left, in half of the time.
    noise = Noise(jnp.array([[1.0]]), jnp.array([[[1.0]], [[-1.0]]]))
    path = bridge(jnp.array([[3.0]]), noise, 0.1)
    assert path.samples[:, 0, 0].tolist() == pytest.approx([1.0, 2.1])
    assert path.velocities[:, 0, 0].tolist() == pytest.approx([2.0, 1.8])


def test_without_noise_the_path_is_a_straight_line():
    noise = Noise(jnp.array([[-1.0, 2.0]]), jnp.zeros((4, 1, 2)))
    path = bridge(jnp.array([[1.0, 0.0]]), noise, 0.5)
    np.testing.assert_allclose(path.velocities, np.tile([2.0, -2.0], (4, 1, 1)), rtol=1e-5)
    np.testing.assert_allclose(path.samples[:, 0, 0], [-1.0, -0.5, 0.0, 0.5], atol=1e-6)


def test_a_gate_stays_open_while_its_actor_is_cloned():
    actor = GatedActor.create(jax.random.key(0), (2, 1), 8)
    followed = actor.cloning_part(jax.tree.map(jnp.ones_like, actor))
    assert [float(leaf.max()) for leaf in jax.tree.leaves(followed.field.gate)] == [0.0, 0.0]
    size = sum(leaf.size for leaf in jax.tree.leaves(actor))
    assert sum(float(leaf.sum()) for leaf in jax.tree.leaves(followed)) == size - (8 + 1)


def test_the_loss_moves_the_running_moments_towards_the_batch():
    actor = GatedActor.create(jax.random.key(0), (2, 1), 8)
    observations = jnp.array([[3.0, 0.0], [5.0, 0.0]])
    path = bridge(jnp.zeros((2, 1)), Noise.draw(jax.random.key(1), (2, 1), 4), 0.1)
    _, (moments, metrics) = matching_loss(actor, actor.moments(), observations, path, 0.1)
    # The four flow steps share one norm of the observation: 1 - 0.99^4 of the way to the mean, 4.
    assert float(moments.observation.mean[0]) == pytest.approx(4.0 * (1 - 0.99**4), rel=1e-5)
    assert int(moments.sample.calls) == 4
    assert float(metrics["matching_loss"]) > 0.0
