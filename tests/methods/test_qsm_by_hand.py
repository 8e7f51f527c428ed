"""What is easily got wrong in QSM, each with its number: critics made by hand, networks that stand still."""

from dataclasses import replace
from functools import cache

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp
from scipy.stats import norm

from hcpg.methods.qsm import QSM, Config
from hcpg.networks.dense import Dense
from hcpg.types import Batch, Spec

ROWS, SIZES = 20_000, Spec(observation_size=1, action_size=2)
STILL = Config(
    gradient_scale=2.0,
    actor_hidden_size=8,
    critic_hidden_size=4,
    actor_learning_rate=0.0,
    critic_learning_rate=0.0,
)
KEPT = np.array([0.80413, 0.43518, 0.15850, 0.03885, 0.00641])
FLAT = ((0.0, 0.0, 0.0, 0.0),) * 2


def along(one, other):
    """Two critics with these slopes along the first action."""
    return ((one, 0.0, 0.0, 0.0), (other, 0.0, 0.0, 0.0))


def critics(networks, numbers):
    """Critic i is x * a + y * b + z * relu(a) + c for actions (a, b) and its four `numbers`.

    The hidden layers pass on 10 + a and 10 + b, which are positive, and relu(a).
    """
    rows = jnp.array(numbers)
    into = jnp.zeros((2, 3, 4)).at[:, 1, (0, 2)].set(1.0).at[:, 2, 1].set(1.0)
    shift = jnp.tile(jnp.array([10.0, 10.0, 0.0, 0.0]), (2, 1))
    out = rows.at[:, 3].set(0.0)[..., None]
    layers = [
        Dense(into, shift),
        Dense(jnp.tile(jnp.eye(4), (2, 1, 1)), jnp.zeros((2, 4))),
        Dense(out, rows[:, 3:] - 10 * rows[:, :2].sum(axis=1, keepdims=True)),
    ]
    return eqx.tree_at(lambda tree: tree.layers, networks, layers)


@cache
def compiled(config):
    method = QSM(config, SIZES)
    return jax.jit(method.init)(jax.random.key(0)), jax.jit(method.update)


def made(online=FLAT, target=FLAT, prediction=0.0, config=STILL):
    """A state with these critics and targets, and a denoiser that predicts one number."""
    state, _ = compiled(config)
    actor = eqx.tree_at(lambda net: net.last, state.actor, Dense.constant(8, 2, prediction))
    critic = state.critic._replace(
        networks=critics(state.critic.networks, online), target=critics(state.critic.target, target)
    )
    return state._replace(actor=actor, critic=critic)


def told(online=FLAT, target=FLAT, prediction=0.0, config=STILL, action=0.5, reward=0.0, seed=0):
    """The metrics of an update in which no network moves, for rows that are all alike."""
    state = made(online, target, prediction, config)
    zeros = jnp.zeros((ROWS, 1))
    batch = Batch(zeros, jnp.full((ROWS, 2), action), jnp.full(ROWS, reward), zeros, jnp.zeros(ROWS))
    return compiled(config)[1](state, batch, jax.random.key(seed))[1]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_noise_is_not_a_target(seed):
    # Q = 3 a: ((2 * 3)^2 + 0) / 2 whatever was drawn; a target of plain diffusion would add its variance.
    metrics = told(along(3.0, 3.0), seed=seed)
    np.testing.assert_allclose(metrics["actor_loss"], 18.0, rtol=1e-5)
    np.testing.assert_allclose(metrics["target_gradient_max"], 6.0, rtol=1e-5)


def test_the_loss_is_the_scale_squared_times_the_mean_squared_gradient():
    sloped = ((1.0, 3.0, 0.0, 0.0),) * 2
    np.testing.assert_allclose(told(sloped)["actor_loss"], 2**2 * (1**2 + 3**2) / 2, rtol=1e-5)
    scaled = told(sloped, config=replace(STILL, gradient_scale=50.0))
    np.testing.assert_allclose(scaled["actor_loss"], 50**2 * (1**2 + 3**2) / 2, rtol=1e-5)


def test_the_best_prediction_is_the_negative_gradient():
    sloped = ((3.0, 3.0, 0.0, 0.0),) * 2
    np.testing.assert_allclose(told(sloped, prediction=-6.0)["actor_loss"], 0.0, atol=1e-6)
    # Its samples then climb Q: tests/networks/test_diffusion.py.
    np.testing.assert_allclose(told(sloped, prediction=6.0)["actor_loss"], 144.0, rtol=1e-5)


def test_the_gradient_is_taken_at_the_noisy_action():
    # Q = relu(a) has slope 1 at the clean action 0.5, and 0 where the noisy one is negative.
    positive = norm.cdf(0.5 * np.sqrt(KEPT / (1 - KEPT))).mean()
    np.testing.assert_allclose(positive, 0.631, atol=1e-3)
    kinked = ((0.0, 0.0, 1.0, 0.0),) * 2
    np.testing.assert_allclose(told(kinked)["actor_loss"], 2**2 * positive / 2, atol=0.03)


def test_the_gradient_is_averaged_over_the_online_critics():
    np.testing.assert_allclose(told(along(3.0, 0.0), along(9.0, 9.0))["actor_loss"], 3.0**2 / 2, rtol=1e-5)


def test_the_bootstrap_is_the_smaller_target_critic():
    # Both online critics are 0, so the loss, half a square for each, is (1 + 0.99 * 3)^2.
    metrics = told(target=((0.0, 0.0, 0.0, 5.0), (0.0, 0.0, 0.0, 3.0)), reward=1.0)
    np.testing.assert_allclose(metrics["critic_loss"], 3.97**2, rtol=1e-5)
    metrics = told(target=((0.0, 0.0, 0.0, -5.0), (0.0, 0.0, 0.0, 3.0)), reward=1.0)
    np.testing.assert_allclose(metrics["critic_loss"], 3.95**2, rtol=1e-5)


def test_noise_smooths_the_next_actions():
    # Samples all sit at 1; clipping takes half of N(0, 0.1^2) off: E[a^2] = 1 - 0.2 / sqrt(2 pi) + 0.005.
    metrics = told(target=along(1.0, 1.0), prediction=-9.0)
    np.testing.assert_allclose(metrics["saturated"], 1.0)
    expected = 0.99**2 * (1 - 0.2 / np.sqrt(2 * np.pi) + 0.005)
    np.testing.assert_allclose(metrics["critic_loss"], expected, rtol=0.004)
    unsmoothed = told(target=along(1.0, 1.0), prediction=-9.0, config=replace(STILL, smoothing=0.0))
    np.testing.assert_allclose(unsmoothed["critic_loss"], 0.99**2, rtol=1e-5)


def test_noise_smooths_behaviour_and_not_evaluation():
    method, state = QSM(STILL, SIZES), made(prediction=-9.0)
    behaved = jax.jit(method.propose, static_argnums=3)(state, jnp.zeros(1), jax.random.key(1), ROWS)
    np.testing.assert_allclose(behaved.mean(), 1 - 0.1 / np.sqrt(2 * np.pi), atol=0.002)
    np.testing.assert_allclose(behaved.std(), 0.1 * np.sqrt(0.5 - 0.5 / np.pi), atol=0.002)
    keys = jax.random.split(jax.random.key(2), 100)
    evaluated = jax.jit(jax.vmap(method.act, in_axes=(None, None, 0)))(state, jnp.zeros(1), keys)
    np.testing.assert_array_equal(evaluated, np.ones((100, 2)))


def test_the_shares_at_the_bound_and_outside_the_box_are_those_on_paper():
    metrics = told(action=0.0)
    beyond = 2 * norm.sf(1 / np.sqrt(1 - KEPT)).mean()
    np.testing.assert_allclose(beyond, 0.2213, atol=1e-4)
    np.testing.assert_allclose(metrics["outside"], beyond, atol=0.009)
    np.testing.assert_allclose(metrics["saturated"], 0.6693, atol=0.01)


def test_the_value_is_the_smaller_online_critics():
    state, actions = made(along(1.0, -3.0)), jnp.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 1.0]])
    found = jax.jit(QSM(STILL, SIZES).value)(state, jnp.zeros(1), actions)
    np.testing.assert_allclose(found, [-1.5, -0.5, 0.0], atol=1e-5)
