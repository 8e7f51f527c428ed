"""FlowRL's losses, weights and samples, with every number worked out by hand."""

import equinox as eqx
import jax
import numpy as np
import pytest
from flowrl_cases import (
    ACTIONS,
    BATCH,
    OBSERVATIONS,
    ROWS,
    answering,
    method_of,
    moved_state,
    update_of,
)
from jax import numpy as jnp

from hcpg.methods.flowrl import Config, Draws, FlowRL, anchor, anchor_weights, expectile_loss
from hcpg.types import Batch


def test_the_published_weighting_weighs_no_sample_by_itself():
    weights, errors = jnp.array([1.0, 0.0]), jnp.array([2.0, 6.0])
    assert float(anchor(weights, errors, "as_published")) == 0.5 * 4.0
    assert float(anchor(weights, errors, "per_sample")) == 1.0
    slope = jax.grad(anchor, argnums=1)
    assert slope(weights, errors, "as_published").tolist() == [0.25, 0.25]
    assert slope(weights, errors, "per_sample").tolist() == [0.5, 0.0]


def test_the_expectile_of_zeros_and_ones_is_nine_tenths():
    samples, value = jnp.array([0.0, 1.0] * 4), jnp.float32(0.5)
    slope = jax.jit(jax.grad(lambda value: expectile_loss(samples - value, 0.9)))
    for _ in range(200):
        value -= 0.5 * slope(value)
    np.testing.assert_allclose(value, 0.9, atol=1e-5)
    np.testing.assert_allclose(expectile_loss(jnp.array([2.0, -2.0]), 0.9), (0.9 * 4 + 0.1 * 4) / 2)


def test_weights_grow_with_the_replayed_actions_advantage_within_bounds():
    own = jnp.zeros(4)
    found = anchor_weights(jnp.array([-5.0, 0.0, 0.0, 4.0]), own, 0.1)  # advantages 0, 0, 0, 4: mean 1
    np.testing.assert_allclose(found, [0.1 / np.e] * 3 + [1.0], rtol=1e-6)  # 0.1 * e^3 = 2.0 is cut to 1
    found = anchor_weights(jnp.array([0.0, 0.0, 0.0, 40.0]), own, 0.1)
    np.testing.assert_allclose(found, [1e-3, 1e-3, 1e-3, 1.0], rtol=1e-6)


def test_weights_pass_no_gradient():
    replayed, own = jnp.array([1.0, 2.0]), jnp.array([0.5, 1.0])
    for argument in (0, 1):
        slope = jax.grad(lambda *values: anchor_weights(*values, 0.1).sum(), argnums=argument)
        assert slope(replayed, own).tolist() == [0.0, 0.0]
    assert float(anchor_weights(replayed, own, 0.1)[1]) > 0.1


def test_four_updates_train_the_critics_and_the_value_four_times_and_the_policy_twice():
    state = moved_state()
    for index in range(4):
        state, _ = update_of("as_published")(state, BATCH, jax.random.key(index))
    optimizers = (
        state.critic_optimizer,
        state.buffer_critic_optimizer,
        state.buffer_value_optimizer,
        state.actor_optimizer,
    )
    assert [int(each[0].count) for each in optimizers] == [4, 4, 4, 2]
    assert int(state.updates) == 4


def test_the_buffer_critic_bootstraps_from_the_online_value_and_a_terminal_row_from_nothing():
    state = moved_state()
    online = answering(state.buffer_critic.online, 2.0)
    state = state._replace(
        buffer_critic=state.buffer_critic._replace(online=online),
        buffer_value=answering(state.buffer_value, 10.0),
    )
    batch = BATCH._replace(rewards=jnp.full(ROWS, 1.0), terminated=jnp.arange(ROWS) < ROWS / 2)
    batch = batch._replace(terminated=batch.terminated.astype(jnp.float32))
    _, metrics = update_of("as_published")(state, batch, jax.random.key(0))
    # Targets: 1 where the episode ended, 1 + 0.99 * 10 elsewhere; both critics say 2.
    expected = 2 * (0.5 * (2 - 1) ** 2 + 0.5 * (2 - 10.9) ** 2)
    np.testing.assert_allclose(metrics["buffer_critic_loss"], expected, rtol=1e-5)
    assert float(metrics["buffer_value"]) == 10.0


def test_the_value_regresses_on_the_smaller_target_of_the_buffer_critics():
    state = moved_state()
    target = answering(state.buffer_critic.target, jnp.array([[5.0], [3.0]]))
    state = state._replace(
        buffer_critic=state.buffer_critic._replace(target=target),
        buffer_value=answering(state.buffer_value, 1.0),
    )
    _, metrics = update_of("as_published")(state, BATCH, jax.random.key(0))
    np.testing.assert_allclose(metrics["buffer_value_loss"], 0.9 * (3 - 1) ** 2, rtol=1e-5)


def test_the_policy_critic_bootstraps_from_the_smaller_target_without_entropy():
    state = moved_state()
    critic = state.critic._replace(
        online=answering(state.critic.online, 0.0),
        target=answering(state.critic.target, jnp.array([[5.0], [3.0]])),
    )
    batch = BATCH._replace(rewards=jnp.ones(ROWS), terminated=jnp.zeros(ROWS))
    _, metrics = update_of("as_published")(state._replace(critic=critic), batch, jax.random.key(0))
    np.testing.assert_allclose(metrics["critic_loss"], 2 * (1 + 0.99 * 3) ** 2, rtol=1e-5)


@pytest.fixture(scope="module")
def still():
    """A state whose flow does not move: samples are tanh of the clamped noise."""
    state = moved_state()
    return state._replace(
        actor=eqx.tree_at(lambda flow: flow.field, state.actor, answering(state.actor.field, 0.0))
    )


def test_proposals_start_at_clamped_noise_and_go_through_tanh_once(still):
    propose = jax.jit(method_of("as_published").propose, static_argnums=3)
    found = propose(still, BATCH.observations[0], jax.random.key(3), 20_000)
    assert found.shape == (20_000, ACTIONS)
    np.testing.assert_allclose([found.min(), found.max()], [-0.7615942, 0.7615942], rtol=1e-6)
    on_the_bounds = (abs(found) > 0.76159).mean()
    np.testing.assert_allclose(on_the_bounds, 0.3173, atol=4 * np.sqrt(0.3173 * 0.6827 / 60_000))
    for one, other in ((0, 1), (1, 2)):
        assert abs(np.corrcoef(found[:, one], found[:, other])[0, 1]) < 4 / np.sqrt(20_000)
    assert abs(np.corrcoef(found[:-1, 0], found[1:, 0])[0, 1]) < 4 / np.sqrt(20_000)


def test_the_anchors_lines_start_at_clamped_noise_too(still):
    """To the action 0 a flow at rest errs by the noise's mean square: 0.516, where unclamped it is 1."""
    rows = 20_000
    observations, actions = jnp.zeros((rows, OBSERVATIONS)), jnp.zeros((rows, ACTIONS))
    batch = Batch(observations, actions, jnp.zeros(rows), observations, jnp.zeros(rows))
    due = still._replace(updates=jnp.int32(1))
    _, metrics = update_of("as_published")(due, batch, jax.random.key(0))
    np.testing.assert_allclose(metrics["anchor_error"], 0.5161, atol=0.01)
    draws = Draws.draw(jax.random.key(1), (rows, ACTIONS))
    assert abs(np.corrcoef(draws.start.ravel(), draws.anchor_start.ravel())[0, 1]) < 4 / np.sqrt(3 * rows)
    assert 0.0 <= float(draws.times.min()) < 0.001 < 0.999 < float(draws.times.max()) < 1.0


def test_the_evaluation_action_is_the_single_proposal_bit_for_bit():
    method, state, observation = method_of("as_published"), moved_state(), BATCH.observations[0]
    act, propose = jax.jit(method.act), jax.jit(method.propose, static_argnums=3)
    key = jax.random.key(4)
    np.testing.assert_array_equal(act(state, observation, key), propose(state, observation, key, 1)[0])
    assert not np.array_equal(act(state, observation, jax.random.key(5)), act(state, observation, key))


def test_the_value_is_the_smaller_policy_critics():
    state = moved_state()
    critic = state.critic._replace(online=answering(state.critic.online, jnp.array([[5.0], [3.0]])))
    found = method_of("as_published").value(
        state._replace(critic=critic), BATCH.observations[0], BATCH.actions
    )
    assert found.tolist() == [3.0] * ROWS


def test_the_defaults_are_the_published_constants():
    config = Config()
    assert (config.learning_rate, config.hidden_size, config.flow_steps) == (3e-4, 512, 1)
    assert (config.policy_delay, config.target_rate, config.discount) == (2, 0.95, 0.99)
    assert (config.expectile, config.anchor_weight, config.weighting) == (0.9, 0.1, "as_published")
    assert FlowRL.sampling == (0.2, 2048)
