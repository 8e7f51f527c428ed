"""The plain stack: by hand; the ensemble: each member on its own."""

import jax
import numpy as np
from jax import numpy as jnp

from hcpg.networks.dense import Dense
from hcpg.networks.mlp import MLP, ensemble, evaluate

SIZES = (3, 5, 5, 2)


def test_the_activation_stands_between_the_layers_and_not_after_the_last():
    double = Dense(2 * jnp.eye(2), jnp.zeros(2))
    found = MLP([double, double], jax.nn.relu)(jnp.array([1.0, -1.0]))
    np.testing.assert_array_equal(found, [4.0, 0.0])
    below = Dense(jnp.eye(2), jnp.full(2, -10.0))
    np.testing.assert_array_equal(MLP([double, below], jax.nn.relu)(jnp.array([1.0, -1.0])), [-8.0, -10.0])


def test_an_ensembles_members_differ_and_answer_as_if_alone():
    members = ensemble(lambda key: MLP.create(key, SIZES), jax.random.key(0), 2)
    x = jax.random.normal(jax.random.key(1), (7, 3))
    found = evaluate(members, x)
    assert found.shape == (2, 7, 2)
    for index in range(2):
        alone = jax.tree.map(lambda leaf, index=index: leaf[index], members)
        np.testing.assert_allclose(alone(x), found[index], atol=1e-6)
    assert float(abs(found[0] - found[1]).min()) > 0


def test_the_initializer_is_the_one_asked_for():
    network = MLP.create(jax.random.key(0), (4, 600, 3), initializer=jax.nn.initializers.ones)
    assert all(float(layer.kernel.min()) == 1.0 for layer in network.layers)
