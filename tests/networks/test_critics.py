"""The two critic recipes: targets and losses by hand, the joint pass, the statistics, averaged targets."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.critics import CrossQ, Polyak, Target, bellman_target, regression
from hcpg.types import Batch

ROWS, OBSERVATIONS, ACTIONS = 6, 4, 2


@pytest.fixture(scope="module")
def batch():
    keys = jax.random.split(jax.random.key(0), 4)
    return Batch(
        jax.random.normal(keys[0], (ROWS, OBSERVATIONS)),
        jnp.tanh(jax.random.normal(keys[1], (ROWS, ACTIONS))),
        jax.random.normal(keys[2], (ROWS,)),
        jax.random.normal(keys[3], (ROWS, OBSERVATIONS)),
        jnp.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0]),
    )


@pytest.fixture(scope="module")
def following():
    actions = jnp.tanh(jax.random.normal(jax.random.key(4), (ROWS, ACTIONS)))
    return Target(actions, jnp.linspace(-1.0, 1.0, ROWS), 0.9)


@pytest.fixture(scope="module")
def crossq():
    recipe = CrossQ(8)
    return recipe, recipe.init(jax.random.key(1), OBSERVATIONS + ACTIONS)


@pytest.fixture(scope="module")
def polyak():
    recipe = Polyak(8)
    return recipe, recipe.init(jax.random.key(1), OBSERVATIONS + ACTIONS)


def same(one, other):
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(*pair) for pair in pairs)


def two_rows(terminated):
    numbers = jnp.zeros((2, 1))
    return Batch(numbers, numbers, jnp.array([1.0, -2.0]), numbers, jnp.array(terminated))


def test_the_target_takes_the_smaller_critic_adds_the_bonus_and_bootstraps_a_time_limit():
    values = jnp.array([[2.0, 8.0], [4.0, 5.0]])  # critics by rows: the smaller are 2 and 5
    following = Target(jnp.zeros((2, 1)), jnp.array([0.5, -1.0]), 0.9)
    target = bellman_target(two_rows([0.0, 0.0]), values, following)
    np.testing.assert_allclose(target, [1 + 0.9 * 2.5, -2 + 0.9 * 4.0], rtol=1e-6)


def test_a_termination_leaves_the_reward_alone():
    following = Target(jnp.zeros((2, 1)), jnp.array([0.5, -1.0]), 0.9)
    target = bellman_target(two_rows([1.0, 0.0]), jnp.full((2, 2), 5.0), following)
    np.testing.assert_allclose(target, [1.0, -2 + 0.9 * 4.0], rtol=1e-6)


def test_no_gradient_flows_through_the_target():
    following = Target(jnp.zeros((2, 1)), jnp.zeros(2), 0.9)
    slope = jax.grad(lambda values: bellman_target(two_rows([0.0, 0.0]), values, following).sum())(
        jnp.ones((2, 2))
    )
    assert not slope.any()


def test_the_loss_is_half_the_mean_square_summed_over_the_critics():
    values = jnp.array([[1.0, 3.0], [0.0, 0.0]])
    loss = regression(values, jnp.array([0.0, 1.0]))  # 0.5 * (1 + 4) / 2 + 0.5 * (0 + 1) / 2
    assert float(loss) == 1.5


def test_crossq_passes_both_steps_through_jointly(crossq, batch, following):
    """Rows in another order leave the joint moments alone; other rows move Q(s, a) itself."""
    recipe, state = crossq
    values = recipe.loss(state.networks, state, batch, following)[1][1]
    turned = batch._replace(next_observations=batch.next_observations[::-1])
    moved = batch._replace(next_observations=batch.next_observations + 3.0)
    back_to_front = following._replace(actions=following.actions[::-1])
    same_set = recipe.loss(state.networks, state, turned, back_to_front)[1][1]
    other_set = recipe.loss(state.networks, state, moved, following)[1][1]
    np.testing.assert_allclose(values, same_set, atol=1e-5)
    assert float(abs(values - other_set).max()) > 0.05


def test_polyak_values_of_this_step_do_not_see_the_next(polyak, batch, following):
    recipe, state = polyak
    moved = batch._replace(next_observations=batch.next_observations + 3.0)
    values = [recipe.loss(state.networks, state, each, following)[1][1] for each in (batch, moved)]
    np.testing.assert_array_equal(*values)


def test_crossq_statistics_move_by_the_joint_batch_and_count_one_call(crossq, batch, following):
    recipe, state = crossq
    after = recipe.loss(state.networks, state, batch, following)[1][0]
    rows = np.concatenate(
        [
            np.concatenate([batch.observations, batch.actions], axis=1),
            np.concatenate([batch.next_observations, following.actions], axis=1),
        ]
    )
    for critic in (0, 1):
        np.testing.assert_allclose(after.moments[0].mean[critic], 0.01 * rows.mean(axis=0), atol=1e-6)
        expected = 0.99 + 0.01 * rows.var(axis=0)
        np.testing.assert_allclose(after.moments[0].variance[critic], expected, atol=1e-6)
    assert [each.calls.tolist() for each in after.moments] == [[1, 1]] * 3
    assert not same(state.moments[2].mean, after.moments[2].mean)


def test_crossq_values_at_inference_see_one_row_at_a_time(crossq):
    recipe, state = crossq
    inputs = jax.random.normal(jax.random.key(5), (3, OBSERVATIONS + ACTIONS))
    every, alone = recipe.values(state, inputs), recipe.values(state, inputs[1:2])
    np.testing.assert_allclose(every[:, 1:2], alone, atol=1e-6)
    assert every.shape == (2, 3)


def test_crossq_has_no_targets_to_move(crossq):
    recipe, state = crossq
    assert state.target == ()
    assert recipe.follow(state) is state


def test_the_two_critics_start_apart(crossq, polyak):
    for recipe, state in (crossq, polyak):
        values = recipe.values(state, jnp.ones((1, OBSERVATIONS + ACTIONS)))
        assert abs(float(values[0, 0] - values[1, 0])) > 1e-3


def test_polyak_targets_start_equal_and_move_by_the_target_rate(polyak):
    recipe, state = polyak
    assert same(state.target, state.networks)
    zeros, ones = (
        jax.tree.map(lambda leaf, x=x: jnp.full(leaf.shape, x), state.networks) for x in (0.0, 1.0)
    )
    moved = recipe.follow(state._replace(networks=ones, target=zeros)).target
    assert {float(value) for leaf in jax.tree.leaves(moved) for value in leaf.ravel()} == {np.float32(0.005)}


def test_polyak_bootstraps_from_its_targets(polyak, batch, following):
    """Targets that answer a constant 7: every loss is half the square to reward + 0.9 (7 + bonus)."""
    recipe, state = polyak
    zero = jax.tree.map(jnp.zeros_like, state.target)
    seven = eqx.tree_at(lambda networks: networks.layers[2].bias, zero, jnp.full((2, 1), 7.0))
    loss, (_, values) = recipe.loss(state.networks, state._replace(target=seven), batch, following)
    aim = batch.rewards + 0.9 * (1 - batch.terminated) * (7 + following.entropy_bonus)
    np.testing.assert_allclose(loss, 0.5 * np.square(values - aim).mean(axis=1).sum(), rtol=1e-5)


def test_polyak_critics_see_where_inputs_lie_only_if_they_are_raw(polyak):
    recipe, state = polyak
    inputs = jnp.linspace(-2.0, 3.0, OBSERVATIONS + ACTIONS)[None]
    moments = state.moments._replace(mean=inputs[0])  # centred: every standardised input is then 0
    centred = state._replace(moments=moments)
    at_zero = recipe._replace(raw=True).values(state, jnp.zeros_like(inputs))
    np.testing.assert_allclose(recipe.values(centred, inputs), at_zero, atol=1e-6)
    raw = recipe._replace(raw=True).values(centred, inputs)
    np.testing.assert_array_equal(raw, recipe._replace(raw=True).values(state, inputs))
    assert float(abs(raw - at_zero).max()) > 0.01
