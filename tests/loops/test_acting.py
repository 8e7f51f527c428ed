"""From observations to actions: whose proposal reaches whom, what is told, and which randomness is used."""

from functools import cache

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from stand_ins import Follower, Reacher, Scalar, read_scene

from hcpg.loops import acting
from hcpg.methods.sac_flow import Config, SACFlow
from hcpg.selection import Selector
from hcpg.types import Spec

ENVIRONMENTS = 5
KEY, LUCK = jax.random.key(1), jax.random.key(2)
OBSERVATIONS = jnp.zeros((ENVIRONMENTS, 3)).at[:, 0].set(jnp.linspace(-0.4, 0.4, ENVIRONMENTS))


def state(level=0.0):
    return Scalar(jnp.float32(level), jnp.int32(0))


@cache
def policy_of(rule, noise, candidates):
    """One compiled program for all tests of the same rule."""
    return jax.jit(acting.guided(Follower(noise), Selector(rule, candidates=candidates), read_scene))


def chosen(rule, observations=OBSERVATIONS, noise=0.0, luck=LUCK):
    return policy_of(rule, noise, 16 if rule == "value" else 4)(state(), observations, KEY, luck)


@pytest.mark.parametrize("rule", ["hcpg", "value", "random"])
def test_candidates_are_never_mixed_between_environments(rule):
    """Every proposal of environment e is its own constant, so its action must be that constant."""
    actions = chosen(rule).actions
    expected = np.tile(np.linspace(-0.4, 0.4, ENVIRONMENTS)[:, None], (1, 4))
    np.testing.assert_allclose(actions, expected, atol=1e-6)


def test_watching_a_selector_changes_nothing():
    """The policy that tells everything acts bit for bit like the one that trains."""
    watched = jax.jit(acting.considered(Follower(1.0), Selector("hcpg", candidates=4), read_scene))
    found = watched(state(), OBSERVATIONS, KEY, LUCK)
    np.testing.assert_array_equal(found.actions, chosen("hcpg", noise=1.0).actions)
    assert found.proposals.shape == (ENVIRONMENTS, 4, 4)
    assert found.scene.goal.tolist() == [[2.0, 0.0, 0.0]] * ENVIRONMENTS
    blended = np.einsum("ek,eka->ea", found.diagnostics.weights, found.proposals)
    np.testing.assert_allclose(found.actions, np.clip(blended, -1, 1), atol=1e-6)


def test_every_environment_has_noise_of_its_own():
    actions = chosen("first", jnp.zeros((ENVIRONMENTS, 3)), noise=1.0).actions
    assert len({float(each) for each in actions[:, 0]}) == ENVIRONMENTS


def test_lots_come_from_the_selectors_stream_and_not_from_the_actors():
    """The same proposals, other lots: another choice; and a rule without lots does not see them."""
    other = jax.random.key(3)
    lots = [chosen("random", noise=1.0, luck=luck).actions for luck in (LUCK, other)]
    none = [chosen("hcpg", noise=1.0, luck=luck).actions for luck in (LUCK, other)]
    assert not np.array_equal(*lots)
    np.testing.assert_array_equal(*none)


def test_the_value_rule_takes_the_proposal_of_the_highest_value():
    """The stand-in's value is minus the square, so the proposal with the smallest square wins."""
    actions = chosen("value", jnp.zeros((ENVIRONMENTS, 3)), noise=1.0).actions
    keys = jax.random.split(KEY, ENVIRONMENTS)
    for action, key in zip(actions, keys, strict=True):
        proposals = Follower(1.0).propose(state(), jnp.zeros(3), key, 16)
        best = jnp.square(proposals).sum(axis=-1).argmin()
        np.testing.assert_allclose(action, proposals[best], atol=1e-6)


def test_what_the_selector_did_is_told_as_means_over_the_environments():
    observations = OBSERVATIONS.at[:, 1].set(jnp.array([1.0, 1.0, 0.0, 0.0, 0.0]))  # two in contact
    seen = chosen("mean", observations).seen
    assert sorted(seen) == [
        "selector_blend_gap", "selector_effective_candidates", "selector_phase", "selector_spread",
    ]  # fmt: skip
    np.testing.assert_allclose(seen["selector_phase"], 2 / 5, rtol=1e-6)
    np.testing.assert_allclose(seen["selector_effective_candidates"], 4.0, rtol=1e-5)
    np.testing.assert_allclose(seen["selector_spread"], 0.0, atol=1e-6)
    np.testing.assert_allclose(chosen("first").seen["selector_effective_candidates"], 1.0, rtol=1e-6)


def test_the_bare_policy_is_the_methods_own_action_and_tells_nothing():
    bare = acting.bare(Follower())(state(0.1), OBSERVATIONS, KEY, LUCK)
    np.testing.assert_allclose(bare.actions[:, 0], 0.1 - np.linspace(-0.4, 0.4, ENVIRONMENTS), atol=1e-6)
    assert bare.seen == {}


def keys_of(runs):
    return jax.random.split(KEY, runs), jax.random.split(LUCK, runs)


def test_every_tick_and_every_run_draws_anew_and_again_the_same():
    states = Scalar(jnp.zeros(2), jnp.int32(0))
    policy = acting.compiled(acting.guided(Follower(1.0), Selector("hcpg"), read_scene), Scalar, runs=2)
    observations = jnp.zeros((2, ENVIRONMENTS, 3))
    first, second, again = (policy(states, observations, *keys_of(2), tick).actions for tick in (0, 1, 0))
    np.testing.assert_array_equal(first, again)
    assert not (first == second).any()
    assert not (first[0] == first[1]).any()


def test_a_run_acts_among_others_as_alone():
    policy = acting.guided(Follower(1.0), Selector("hcpg"), read_scene)
    observations = jnp.stack([OBSERVATIONS, OBSERVATIONS + 0.1])
    keys, lucks = keys_of(2)
    two, one = (Scalar(jnp.zeros(runs), jnp.int32(0)) for runs in (2, 1))
    both = acting.compiled(policy, Scalar, 2)(two, observations, keys, lucks, 7)
    alone = acting.compiled(policy, Scalar, 1)(one, observations[1:], keys[1:], lucks[1:], 7)
    np.testing.assert_allclose(both.actions[1], alone.actions[0], atol=1e-6)
    np.testing.assert_allclose(both.seen["selector_spread"][1], alone.seen["selector_spread"][0], rtol=1e-5)


def test_warm_up_actions_are_uniform_over_the_whole_range():
    actions = acting.warmup(runs=2, environments=1000, action_size=4)(jax.random.split(KEY, 2), 3).actions
    assert actions.shape == (2, 1000, 4)
    assert float(actions.min()) >= -1.0
    assert float(actions.max()) <= 1.0
    counts, _ = np.histogram(actions, bins=4, range=(-1, 1))
    assert np.abs(counts - 2000).max() < 4 * np.sqrt(8000 * 0.25 * 0.75)
    assert not np.array_equal(actions[0], actions[1])


def test_hcpg_over_one_candidate_is_sac_flow_bit_for_bit():
    method = SACFlow(Config(actor_hidden_size=8, critic_hidden_size=8), Spec(3, 4))
    fresh = jax.jit(method.init)(jax.random.key(0))
    policies = [acting.guided(method, Selector(rule, candidates=1), read_scene) for rule in ("hcpg", "first")]
    guided, first = (jax.jit(each)(fresh, OBSERVATIONS, KEY, LUCK).actions for each in policies)
    bare = jax.jit(acting.bare(method))(fresh, OBSERVATIONS, KEY, LUCK).actions
    np.testing.assert_array_equal(guided, first)
    np.testing.assert_array_equal(guided, bare)
    assert float(abs(guided).min()) > 0.0


def test_ranking_by_value_needs_a_method_with_a_critic():
    with pytest.raises(TypeError, match=r"'value' needs a method with .value., got .*Reacher"):
        acting.guided(Reacher(), Selector("value"), read_scene)
