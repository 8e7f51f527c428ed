"""Every method on one step of `point/reach`, whose value is known on paper: 1 - tanh(distance / 0.1 m)."""

from copy import deepcopy

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg import registry
from hcpg.methods import flowrl, qsm, sac, sac_flow
from hcpg.types import Batch

STRIDE_M, TRANSITIONS, ROWS, UPDATES = 0.02, 2048, 64, 1600
BEST = np.array([0.5, -0.25, -0.75])
"""The move that brings the tool to the object; the gripper has no say."""
SIZES = {"actor_hidden_size": 32, "critic_hidden_size": 32}
RATES = {"actor_learning_rate": 3e-3, "critic_learning_rate": 3e-3}
LEARNERS = {
    # Without any entropy its actor is at a corner before the critic knows better, and tanh keeps it there.
    "sac": (sac, {**SIZES, **RATES, "initial_temperature": 1e-2}),
    "flowrl": (flowrl, {"hidden_size": 32, "learning_rate": 3e-3, "anchor_weight": 1e-3}),
    "qsm": (qsm, {**SIZES, **RATES, "gradient_scale": 5.0}),
    "sac_flow": (
        sac_flow,
        {**SIZES, **RATES, "actor_learning_rate": 2e-3, "initial_temperature": 1e-6, "policy_delay": 1},
    ),
}


def on_paper(moves):
    """What a move earns: after it the tool is a stride times `moves - BEST` off the object."""
    return 1 - np.tanh(STRIDE_M * np.linalg.norm(moves - BEST, axis=-1) / 0.1)


@pytest.fixture(scope="module")
def one_step():
    """Uniform actions out of one state; that its episode ends there leaves the reward as the value."""
    task = registry.task("point/reach")
    environment = registry.suite(task.suite).make(task, seed=0)
    observation = environment.reset(0)
    while np.abs(ahead := (observation[4:7] - observation[:3]) / STRIDE_M).max() > 1e-3:
        move = np.append(np.clip(ahead, -1, 1), -1.0).astype(np.float32)
        observation = environment.step(move).observation
    observation = environment.step(np.append(-BEST, -1.0).astype(np.float32)).observation
    actions = np.random.default_rng(0).uniform(-1, 1, (TRANSITIONS, 4)).astype(np.float32)
    steps = [deepcopy(environment).step(action) for action in actions]
    rewards = np.array([step.reward for step in steps], np.float32)
    following = np.stack([step.observation for step in steps])
    rows = np.tile(observation, (TRANSITIONS, 1)), actions, rewards, following, np.ones_like(rewards)
    return Batch(*map(jnp.asarray, rows))


@pytest.fixture(scope="module", params=LEARNERS)
def learned(request, one_step):
    """Values of 50 actions, those actions, and 50 proposals, after all updates; NumPy arrays."""
    module, settings = LEARNERS[request.param]
    task = registry.task("point/reach")
    method = module.METHOD(module.Config(**settings), registry.suite(task.suite).spec(task))

    def update(state, key):
        of_rows, of_update = jax.random.split(key)
        rows = jax.random.randint(of_rows, (ROWS,), 0, TRANSITIONS)
        return method.update(state, jax.tree.map(lambda column: column[rows], one_step), of_update)[0], None

    def run(key):
        of_init, of_updates, of_proposals = jax.random.split(key, 3)
        state = jax.lax.scan(update, method.init(of_init), jax.random.split(of_updates, UPDATES))[0]
        observation, actions = one_step.observations[0], one_step.actions[:50]
        values = method.value(state, observation, actions)
        return values, actions, method.propose(state, observation, of_proposals, 50)

    return [np.asarray(each) for each in jax.jit(run)(jax.random.key(0))]


def test_the_environment_pays_what_the_paper_says(one_step):
    np.testing.assert_allclose(one_step.rewards, on_paper(one_step.actions[:, :3]), atol=1e-4)
    assert on_paper(BEST) == 1.0
    np.testing.assert_allclose(on_paper(np.zeros(3)), 1 - np.tanh(0.2 * np.sqrt(0.875)), rtol=1e-12)


def test_a_move_is_worth_what_it_earns(learned):
    """A critic that answers with the mean reward everywhere would be 0.06 off."""
    values, actions, _ = learned
    errors = np.abs(values - on_paper(actions[:, :3]))
    assert errors.mean() < 0.03
    assert errors.max() < 0.1


def test_the_proposals_go_to_the_object(learned):
    """Staying is worth 0.815, the best move 1."""
    assert on_paper(learned[2][:, :3].mean(axis=0)) > 0.93
