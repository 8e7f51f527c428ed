"""The classical critics: what they bootstrap from, what a termination leaves, how their targets move."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.critics import Critics, Target
from hcpg.networks.plain_critics import Plain
from hcpg.types import Batch

ROWS, OBSERVATIONS, ACTIONS = 4, 3, 2


@pytest.fixture(scope="module")
def recipe():
    return Plain((8, 8, 8))


@pytest.fixture(scope="module")
def state(recipe):
    return recipe.init(jax.random.key(1), OBSERVATIONS + ACTIONS)


@pytest.fixture(scope="module")
def batch():
    keys = jax.random.split(jax.random.key(0), 3)
    observations, following = jax.random.normal(keys[0], (2, ROWS, OBSERVATIONS))
    actions = jnp.tanh(jax.random.normal(keys[1], (ROWS, ACTIONS)))
    rewards = jax.random.normal(keys[2], (ROWS,))
    return Batch(observations, actions, rewards, following, jnp.array([0.0, 1.0, 0.0, 0.0]))


def constant(networks, first, second):
    """The two networks, answering one number each."""
    zero = jax.tree.map(jnp.zeros_like, networks)
    biases = jnp.array([[first], [second]])
    return eqx.tree_at(lambda networks: networks.layers[3].bias, zero, biases)


def test_it_is_a_recipe_with_three_hidden_layers_and_no_statistics(recipe, state):
    assert isinstance(recipe, Critics)
    assert [layer.kernel.shape for layer in state.networks.layers] == [(2, 5, 8), *[(2, 8, 8)] * 2, (2, 8, 1)]
    assert state.moments == ()


def test_the_target_is_the_smaller_target_critic_and_a_termination_leaves_the_reward(recipe, state, batch):
    """Targets that answer 3 and 7 (mean 5), online critics that answer 0: the loss is the target's square."""
    fixed = state._replace(target=constant(state.target, 3.0, 7.0))
    following = Target(jnp.zeros((ROWS, ACTIONS)), jnp.full(ROWS, 0.5), 0.9)
    online = constant(state.networks, 0.0, 0.0)
    loss, (_, values) = recipe.loss(online, fixed, batch, following)
    aim = np.asarray(batch.rewards) + np.array([3.15, 0.0, 3.15, 3.15])  # 0.9 * (3 + 0.5)
    np.testing.assert_allclose(loss, np.square(aim).mean(), rtol=1e-5)  # two critics, half each
    np.testing.assert_array_equal(values, np.zeros((2, ROWS)))


def test_only_the_online_critics_get_a_gradient(recipe, state, batch):
    following = Target(jnp.zeros((ROWS, ACTIONS)), jnp.zeros(ROWS), 0.9)
    slope = jax.grad(
        lambda target: recipe.loss(state.networks, state._replace(target=target), batch, following)[0]
    )
    assert not any(leaf.any() for leaf in jax.tree.leaves(slope(state.target)))
    own = jax.grad(lambda networks: recipe.loss(networks, state, batch, following)[0])(state.networks)
    assert all(leaf.any() for leaf in jax.tree.leaves(own))


def test_values_are_the_online_critics(recipe, state):
    moved = state._replace(networks=constant(state.networks, 1.0, -2.0))
    inputs = jnp.ones((3, OBSERVATIONS + ACTIONS))
    np.testing.assert_array_equal(recipe.values(moved, inputs), [[1.0] * 3, [-2.0] * 3])
    fresh = recipe.values(state, inputs)
    assert abs(float(fresh[0, 0] - fresh[1, 0])) > 1e-3


def test_targets_start_equal_and_move_by_the_target_rate(recipe, state):
    pairs = zip(*map(jax.tree.leaves, (state.target, state.networks)), strict=True)
    assert all(np.array_equal(*pair) for pair in pairs)
    zeros, ones = (
        jax.tree.map(lambda leaf, x=x: jnp.full(leaf.shape, x), state.networks) for x in (0.0, 1.0)
    )
    moved = recipe.follow(state._replace(networks=ones, target=zeros)).target
    assert {float(value) for leaf in jax.tree.leaves(moved) for value in leaf.ravel()} == {np.float32(0.005)}
