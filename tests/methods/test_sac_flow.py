"""SAC-Flow's update against an independent one in PyTorch; its delays, keys, proposals and defaults."""

from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
import pytest
import torch_fields
import torch_sac_flow
from jax import numpy as jnp
from one_update import assert_learned_alike, gradient_of, move, transitions
from scipy import stats

from hcpg.methods.sac_flow import POLICY_METRICS, Config, SACFlow, State
from hcpg.networks.batch_renorm import Moments
from hcpg.networks.critics import CriticState
from hcpg.networks.flow import Noise, Path
from hcpg.types import Batch, Spec

ROWS, OBSERVATIONS, ACTIONS = 8, 5, 3
TINY = Config(actor_hidden_size=8, critic_hidden_size=8, decoder_hidden_size=8)
VARIANTS = {
    "crossq": {},
    "polyak": {"critic": "polyak"},
    "plain": {"velocity": "plain"},
    "plain, norm per step": {"velocity": "plain", "plain_norm": "per_step", "flow_steps": 2},
    "decoder": {"velocity": "decoder", "flow_steps": 2},
}
BATCH = transitions(ROWS, OBSERVATIONS, ACTIONS)
BETA_1 = 0.5


class Case(NamedTuple):
    """One update of a moved state, at which the actor is due."""

    method: SACFlow
    before: State
    after: State
    metrics: dict
    batch: Batch
    noises: tuple
    """For the target's next actions, and for the actor's loss."""
    variant: str


@cache
def method_of(variant):
    return SACFlow(replace(TINY, **VARIANTS[variant]), Spec(OBSERVATIONS, ACTIONS))


@cache
def update_of(variant):
    return jax.jit(method_of(variant).update)


@cache
def moved_state(variant):
    """A state whose every parameter is off its start, so that none can be left out unnoticed."""

    def watched(moments):
        generator = np.random.default_rng(moments.mean.size)
        spread = jnp.asarray(generator.uniform(0.5, 2.0, moments.mean.shape), jnp.float32)
        return Moments(jnp.asarray(generator.normal(size=spread.shape), jnp.float32), spread, moments.calls)

    state = jax.jit(method_of(variant).init)(jax.random.key(0))
    networks, moments, target = state.critic
    actor = move(state.actor, 5)
    # Less noise, so that a sample or two saturate, but not all.
    raw = jnp.full(ACTIONS, 0.3 if method_of(variant).config.velocity == "decoder" else -0.3)
    actor = eqx.tree_at(lambda actor: getattr(actor.deviation, "last", actor.deviation).bias, actor, raw)
    watch = partial(jax.tree.map, watched, is_leaf=lambda node: isinstance(node, Moments))
    return state._replace(
        actor=actor,
        actor_moments=watch(state.actor_moments),
        critic=CriticState(move(networks, 1), watch(moments), move(target, 2)),
    )


@pytest.fixture(scope="module", params=VARIANTS)
def case(request):
    before = moved_state(request.param)._replace(updates=jnp.int32(2))  # the third update: the actor is due
    key = jax.random.key(9)
    after, metrics = update_of(request.param)(before, BATCH, key)
    steps = method_of(request.param).config.flow_steps
    noises = tuple(Noise.draw(each, (ROWS, ACTIONS), steps) for each in jax.random.split(key))
    return Case(method_of(request.param), before, after, metrics, BATCH, noises, request.param)


def test_the_critic_update_equals_the_one_in_torch(case):
    reference = torch_sac_flow.critic_update(case.method.config, case.before, case.batch, case.noises[0])
    np.testing.assert_allclose(case.metrics["critic_loss"], reference.loss, rtol=1e-5)
    np.testing.assert_allclose(case.metrics["value"], reference.extra["value"], rtol=1e-4, atol=1e-6)
    assert_learned_alike(case.after.critic.networks, case.after.critic_optimizer, reference, beta_1=BETA_1)
    moments = case.after.critic.moments
    if case.method.config.critic == "polyak":
        pairs = [(moments, reference.extra["statistics"])]
    else:
        seen = reference.extra["statistics"]  # critic by critic, layer by layer
        own = [jax.tree.map(lambda leaf, at=at: leaf[at], each) for at in (0, 1) for each in moments]
        pairs = list(zip(own, [*seen[0], *seen[1]], strict=True))
    for own, (mean, variance) in pairs:
        np.testing.assert_allclose(own.mean, mean, atol=1e-5)
        np.testing.assert_allclose(own.variance, variance, atol=1e-5)


def test_the_actor_update_equals_the_one_in_torch(case):
    seen = case.before._replace(critic=case.after.critic)
    reference = torch_sac_flow.actor_update(case.method.config, seen, case.batch, case.noises[1])
    np.testing.assert_allclose(case.metrics["actor_loss"], reference.loss, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(case.metrics["path_entropy"], reference.extra["entropy"], rtol=1e-4)
    norm = np.sqrt(sum((slope**2).sum() for slope in reference.gradient))
    np.testing.assert_allclose(case.metrics["actor_gradient"], norm, rtol=1e-4)
    # A bias or a time before a norm has no gradient: that leaves 35 of the decoder's 58 arrays.
    share = 0.5 if case.method.config.velocity == "decoder" else 0.7
    assert_learned_alike(case.after.actor, case.after.actor_optimizer, reference, beta_1=BETA_1, share=share)
    for place, (mean, variance) in reference.extra["statistics"].items():
        moments = torch_fields.at(case.after.actor_moments, place)
        np.testing.assert_allclose(moments.mean, mean, atol=1e-5)
        np.testing.assert_allclose(moments.variance, variance, atol=1e-5)
        config = case.method.config
        once = place[0] in ("observation", "samples") and config.velocity == "decoder"
        once = once or config.plain_norm == "per_step"
        assert int(moments.calls) == (1 if once else case.method.config.flow_steps)
    assert len(reference.extra["statistics"]) == len(jax.tree.leaves(case.after.actor_moments)) / 3


def test_the_gradients_by_the_flows_ends_equal_those_in_torch(case):
    """Root mean square over the rows, of a loss that is each row's own: 8 times the mean's gradient."""
    seen = case.before._replace(critic=case.after.critic)
    start, end = torch_sac_flow.slopes_by_ends(case.method.config, seen, case.batch, case.noises[1])
    for name, slope in (("start_gradient", start), ("end_gradient", end)):
        rows = np.linalg.norm(ROWS * slope, axis=1)
        np.testing.assert_allclose(case.metrics[name], np.sqrt((rows**2).mean()), rtol=1e-4)


def test_the_path_density_is_that_of_its_gaussian_steps(case):
    acting = torch_fields.Norms(case.before.actor_moments, learning=False)
    state, observations = case.before, torch_fields.constants(case.batch.observations)
    actor, noise = torch_fields.constants(state.actor), case.noises[0]
    samples, means, deviations = (
        np.array([each.numpy() for each in every])
        for every in torch_fields.path(actor, case.method.config.velocity, acting, observations, noise)
    )
    expected = stats.norm.logpdf(samples[0]).sum(axis=-1)
    expected += stats.norm.logpdf(samples[1:], means, deviations).sum(axis=(0, 2))
    expected -= np.log(1 - np.tanh(samples[-1]) ** 2 + 1e-6).sum(axis=-1)
    infer = jax.jit(lambda actor, *rest: actor.infer(*rest))
    path = infer(state.actor, state.actor_moments, case.batch.observations, noise)
    np.testing.assert_allclose(path.actions, np.tanh(samples[-1]), atol=2e-5)
    np.testing.assert_allclose(path.log_prob, expected, atol=1e-4, rtol=2e-5)


def test_the_temperature_falls_by_one_step_while_the_entropy_exceeds_its_target(case):
    surplus = float(case.metrics["path_entropy"])
    np.testing.assert_allclose(
        gradient_of(case.after.temperature_optimizer, BETA_1), [0.2 * surplus], rtol=1e-4
    )
    step = float(case.after.log_temperature - case.before.log_temperature)
    np.testing.assert_allclose(step, -np.sign(surplus) * 1e-3, rtol=1e-3)
    np.testing.assert_allclose(case.metrics["temperature"], 0.2 * np.exp(step), rtol=1e-5)


def test_targets_move_by_the_target_rate_after_the_step(case):
    if case.method.config.critic == "crossq":
        assert case.after.critic.target == ()
        return
    trees = case.before.critic.target, case.after.critic.networks, case.after.critic.target
    for old, online, new in zip(*map(jax.tree.leaves, trees), strict=True):
        np.testing.assert_allclose(new, 0.995 * old + 0.005 * online, atol=1e-6)


def test_the_actor_update_leaves_the_critics_and_their_statistics_alone(case):
    early = case.before._replace(updates=jnp.int32(0))  # the first update: only the critics are due
    after, metrics = update_of(case.variant)(early, case.batch, jax.random.key(9))
    for one, other in zip(*map(jax.tree.leaves, (after.critic, case.after.critic)), strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(*map(jax.tree.leaves, (after.actor, case.before.actor)), strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(
        *map(jax.tree.leaves, (after.actor_moments, case.before.actor_moments)), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    assert all(np.isnan(metrics[name]) for name in POLICY_METRICS)


def test_three_updates_train_the_critics_thrice_and_actor_and_temperature_once():
    state = moved_state("crossq")
    first = state.critic.networks.layers[2].bias
    for index in range(3):
        state, metrics = update_of("crossq")(state, BATCH, jax.random.key(index))
        if index == 0:
            steps = state.critic.networks.layers[2].bias - first
            np.testing.assert_allclose(abs(steps), np.full((2, 1), 1e-3), rtol=1e-3)
    optimizers = state.critic_optimizer, state.actor_optimizer, state.temperature_optimizer
    assert [int(each[0].count) for each in optimizers] == [3, 1, 1]
    assert int(state.updates) == 3
    assert [each.calls.tolist() for each in state.critic.moments] == [[3, 3]] * 3
    assert all(np.isfinite(value) for value in metrics.values())


def test_the_published_density_is_refused_for_fields_whose_density_is_right():
    with pytest.raises(ValueError, match=r"'decoder's alone, not that of 'plain': choose"):
        Config(velocity="plain", density="as_published")


def test_a_norm_per_step_is_refused_for_fields_that_have_no_shared_one():
    with pytest.raises(ValueError, match=r"'plain's alone, not that of 'gated': choose"):
        Config(plain_norm="per_step")


def test_raw_inputs_are_refused_for_critics_that_always_standardise():
    with pytest.raises(ValueError, match=r"'polyak's alone, not that of 'crossq': choose"):
        Config(polyak_inputs="raw")


def test_the_defaults_are_the_official_recipe():
    config = Config()
    assert config.plain_norm == "shared"
    assert (config.critic, config.flow_steps, config.policy_delay) == ("crossq", 4, 3)
    assert (config.velocity, config.density, config.decoder_hidden_size) == ("gated", "corrected", 96)
    assert (config.actor_learning_rate, config.critic_learning_rate) == (3e-4, 1e-3)
    assert (config.temperature_learning_rate, config.momentum, config.discount) == (1e-3, 0.5, 0.99)
    assert (config.initial_temperature, config.target_entropy) == (0.2, 0.0)
    assert (config.actor_hidden_size, config.critic_hidden_size) == (512, 1024)
    assert abs(float(jnp.exp(moved_state("crossq").log_temperature)) - 0.2) < 1e-6


@pytest.fixture(scope="module")
def pairs():
    """2000 times two proposals for one observation."""
    method, state = method_of("crossq"), moved_state("crossq")
    keys = jax.random.split(jax.random.key(3), 2000)
    observation = BATCH.observations[0]
    return jax.jit(jax.vmap(lambda key: method.propose(state, observation, key, 2)))(keys)


def test_proposals_of_one_set_are_independent_and_alike_in_distribution(pairs):
    for action in range(ACTIONS):
        first, second = pairs[:, 0, action], pairs[:, 1, action]
        assert abs(np.corrcoef(first, second)[0, 1]) < 4 / np.sqrt(len(pairs))
        assert abs(float(first.mean() - second.mean())) < 4 * float(first.std()) * np.sqrt(2 / len(pairs))
    assert pairs.shape == (2000, 2, ACTIONS)
    assert float(abs(pairs).max()) <= 1.0
    assert float(pairs.std(axis=0).min()) > 0.1


def test_proposals_of_one_set_share_no_number_of_their_noise():
    """Start and all four steps, of four proposals with three actions each: 60 different draws."""
    drawn = []

    class Watched:
        def infer(self, moments, observations, noise):
            drawn.append(np.concatenate([noise.start[None], noise.steps]))
            return Path(jnp.tanh(noise.start), jnp.zeros(4))

    state = moved_state("crossq")._replace(actor=Watched())
    method_of("crossq").propose(state, BATCH.observations[0], jax.random.key(3), 4)
    [noise] = drawn
    assert noise.shape == (5, 4, ACTIONS)
    assert len(np.unique(noise)) == 60


def test_the_evaluation_action_is_the_single_proposal_bit_for_bit():
    method, state, observation = method_of("crossq"), moved_state("crossq"), BATCH.observations[0]
    act, propose = jax.jit(method.act), jax.jit(method.propose, static_argnums=3)
    key = jax.random.key(4)
    np.testing.assert_array_equal(act(state, observation, key), propose(state, observation, key, 1)[0])
    assert not np.array_equal(act(state, observation, jax.random.key(5)), act(state, observation, key))


def test_the_value_is_the_smaller_critics_of_each_action_alone(case):
    observation, actions = case.batch.observations[0], case.batch.actions
    value = jax.jit(case.method.value)
    rows = jnp.concatenate([jnp.tile(observation, (ROWS, 1)), actions], axis=-1)
    both = case.method.critics.values(case.before.critic, rows)
    np.testing.assert_allclose(value(case.before, observation, actions), np.min(both, axis=0), rtol=1e-5)
    alone = value(case.before, observation, actions[3:4])
    np.testing.assert_allclose(alone, np.min(both, axis=0)[3:4], rtol=1e-4)
