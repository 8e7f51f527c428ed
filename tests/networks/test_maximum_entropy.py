"""The steps of a maximum-entropy learner, by hand on linear critics and with plain gradient descent."""

import jax
import numpy as np
import optax
import pytest
from jax import numpy as jnp

from hcpg.networks.critics import Target
from hcpg.networks.dense import Dense
from hcpg.networks.maximum_entropy import (
    improve_critics,
    improve_temperature,
    pessimistic_values,
    soft_target,
)
from hcpg.networks.mlp import MLP
from hcpg.networks.plain_critics import Plain
from hcpg.types import Batch

RECIPE = Plain((), target_rate=0.1)


def linear(kernels):
    """The state of two critics without hidden layers: one weight for the observation, one for the action."""
    fresh = RECIPE.init(jax.random.key(0), 2)
    network = MLP([Dense(jnp.array(kernels)[:, :, None], jnp.zeros((2, 1)))], jax.nn.relu)
    return fresh._replace(networks=network, target=jax.tree.map(jnp.zeros_like, network))


def test_the_critics_take_one_step_and_then_their_targets_a_tenth_of_the_way_to_them():
    """Values 0, reward 1 that ends: loss 2 * 0.5, slope of each bias -1, so half a step gives 0.5."""
    numbers = jnp.zeros((2, 1))
    batch = Batch(numbers, numbers, jnp.ones(2), numbers, jnp.ones(2))
    following, descent = Target(numbers, jnp.zeros(2), 0.9), optax.sgd(0.5)
    state = linear([[0.0, 0.0], [0.0, 0.0]])
    after, _, metrics = improve_critics(
        RECIPE, state, batch, following, descent, descent.init(state.networks)
    )
    np.testing.assert_allclose(after.networks.layers[0].bias, [[0.5], [0.5]], atol=1e-6)
    np.testing.assert_allclose(after.target.layers[0].bias, [[0.05], [0.05]], atol=1e-6)
    assert (float(metrics["critic_loss"]), float(metrics["value"])) == (1.0, 0.0)


def test_the_value_is_the_smaller_at_one_observation_for_all_or_at_each_actions_own():
    """Critics o + a and 3a."""
    critics, actions = linear([[1.0, 1.0], [0.0, 3.0]]), jnp.array([[0.5], [-0.5]])
    shared = pessimistic_values(RECIPE, critics, jnp.array([2.0]), actions)
    np.testing.assert_allclose(shared, [1.5, -1.5], atol=1e-6)
    own = pessimistic_values(RECIPE, critics, jnp.array([[-1.0], [-3.0]]), actions)
    np.testing.assert_allclose(own, [-0.5, -3.5], atol=1e-6)


@pytest.mark.parametrize(("surplus", "change"), [(3.0, -0.6), (-3.0, 0.6)])
def test_the_temperature_rises_while_the_entropy_is_below_its_target(surplus, change):
    """Temperature 2: the slope in its logarithm is 2 * surplus, and the step a tenth of it."""
    descent, start = optax.sgd(0.1), jnp.log(2.0)
    after, _ = improve_temperature(start, jnp.asarray(surplus), descent, descent.init(start))
    np.testing.assert_allclose(after - start, change, atol=1e-5)


def test_a_likely_action_adds_less_to_the_target_than_an_unlikely_one():
    """Temperature 2: log-probabilities of 1 and -3 nats add -2 and 6."""
    actions = jnp.array([[0.1], [0.2]])
    target = soft_target(actions, jnp.array([1.0, -3.0]), jnp.log(2.0), 0.9)
    np.testing.assert_allclose(target.entropy_bonus, [-2.0, 6.0], rtol=1e-6)
    assert target.actions is actions
    assert target.discount == 0.9
