"""FlowRL's update against an independent one in PyTorch; its order, its delay and its targets."""

from functools import cache
from typing import NamedTuple

import jax
import numpy as np
import pytest
import torch_flowrl
from flowrl_cases import ACTIONS, BATCH, ROWS, method_of, moved_state, update_of
from jax import numpy as jnp
from one_update import assert_learned_alike

from hcpg.methods.flowrl import POLICY_METRICS, Draws, FlowRL, State
from hcpg.networks.midpoint import clamped_normal
from hcpg.types import Batch

CLOSE = {"rtol": 2e-4, "atol": 2e-5, "step_atol": 5e-5}
"""How close its gradients and parameters come: its learning rate here is 1e-2."""


class Case(NamedTuple):
    """One update of a moved state, at which the policy is due."""

    method: FlowRL
    before: State
    after: State
    metrics: dict
    batch: Batch
    start: np.ndarray
    """Where the samples of the next actions start."""
    draws: Draws


@cache
def case_of(weighting):
    before = moved_state()._replace(updates=jnp.int32(1))  # the second update: the policy is due
    of_target, of_policy = jax.random.split(jax.random.key(9))
    after, metrics = update_of(weighting)(before, BATCH, jax.random.key(9))
    shape = (ROWS, ACTIONS)
    start, draws = np.array(clamped_normal(of_target, shape)), Draws.draw(of_policy, shape)
    return Case(method_of(weighting), before, after, metrics, BATCH, start, draws)


@pytest.fixture(scope="module", params=["as_published", "per_sample"])
def case(request):
    return case_of(request.param)


def test_the_critic_update_equals_the_one_in_torch(case):
    reference = torch_flowrl.critic_update(case.method.config, case.before, case.batch, case.start)
    np.testing.assert_allclose(case.metrics["critic_loss"], reference.loss, rtol=1e-4)
    assert_learned_alike(case.after.critic.online, case.after.critic_optimizer, reference, **CLOSE)


def test_the_buffer_critic_update_equals_the_one_in_torch(case):
    reference = torch_flowrl.buffer_critic_update(case.method.config, case.before, case.batch)
    np.testing.assert_allclose(case.metrics["buffer_critic_loss"], reference.loss, rtol=1e-4)
    assert_learned_alike(
        case.after.buffer_critic.online, case.after.buffer_critic_optimizer, reference, **CLOSE
    )


def test_the_buffer_value_update_equals_the_one_in_torch(case):
    reference = torch_flowrl.buffer_value_update(case.method.config, case.before, case.batch)
    np.testing.assert_allclose(case.metrics["buffer_value_loss"], reference.loss, rtol=1e-4)
    assert_learned_alike(case.after.buffer_value, case.after.buffer_value_optimizer, reference, **CLOSE)


def test_the_policy_update_equals_the_one_in_torch(case):
    """It sees the policy critic from after its step, and the buffer critic from before its own."""
    seen = case.before._replace(critic=case.after.critic)
    config, critic = case.method.config, case.before.buffer_critic.online
    reference, weight = torch_flowrl.actor_update(config, seen, critic, case.batch, case.draws)
    np.testing.assert_allclose(case.metrics["actor_loss"], reference.loss, rtol=1e-4)
    np.testing.assert_allclose(case.metrics["anchor_weight"], weight, rtol=1e-4)
    norm = np.sqrt(sum((slope**2).sum() for slope in reference.gradient))
    np.testing.assert_allclose(case.metrics["actor_gradient"], norm, rtol=1e-4)
    assert_learned_alike(case.after.actor, case.after.actor_optimizer, reference, **CLOSE)


@pytest.mark.parametrize("moment", ["buffer critic after its step", "policy critic before its step"])
def test_the_other_order_would_be_seen(moment):
    case = case_of("per_sample")
    seen, critic = case.before._replace(critic=case.after.critic), case.before.buffer_critic.online
    if moment == "buffer critic after its step":
        critic = case.after.buffer_critic.online
    else:
        seen = case.before
    other, _ = torch_flowrl.actor_update(case.method.config, seen, critic, case.batch, case.draws)
    assert abs(float(case.metrics["actor_loss"]) - other.loss) > 1e-3 * abs(other.loss)


def test_the_two_weightings_learn_differently_from_the_same_data():
    one, other = case_of("as_published"), case_of("per_sample")
    np.testing.assert_allclose(one.metrics["anchor_weight"], other.metrics["anchor_weight"], rtol=1e-6)
    assert abs(float(one.metrics["actor_loss"] - other.metrics["actor_loss"])) > 1e-3
    for left, right in zip(*map(jax.tree.leaves, (one.after.critic, other.after.critic)), strict=True):
        np.testing.assert_array_equal(left, right)


def test_targets_take_over_95_of_100_parts_of_the_critics(case):
    for before, after in (
        (case.before.critic, case.after.critic),
        (case.before.buffer_critic, case.after.buffer_critic),
    ):
        trees = before.target, after.online, after.target
        for old, online, new in zip(*map(jax.tree.leaves, trees), strict=True):
            np.testing.assert_allclose(new, 0.05 * old + 0.95 * online, atol=1e-6)


def test_where_the_policy_is_not_due_it_and_the_targets_stay_and_the_critics_learn_the_same(case):
    update = update_of(case.method.config.weighting)
    early, metrics = update(case.before._replace(updates=jnp.int32(0)), case.batch, jax.random.key(9))

    def same(one, other):
        pairs = zip(*map(jax.tree.leaves, (one, other)), strict=True)
        return all(np.array_equal(left, right) for left, right in pairs)

    assert same(early.actor, case.before.actor)
    assert same(early.critic.target, case.before.critic.target)
    assert same(early.buffer_critic.target, case.before.buffer_critic.target)
    # The policy's loss has thus no gradient into any critic.
    assert same(early.critic.online, case.after.critic.online)
    assert same(early.buffer_critic.online, case.after.buffer_critic.online)
    assert same(early.buffer_value, case.after.buffer_value)
    assert all(np.isnan(metrics[name]) for name in POLICY_METRICS)
    assert not any(np.isnan(case.metrics[name]) for name in metrics)
