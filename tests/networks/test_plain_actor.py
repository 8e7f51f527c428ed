"""The plain field: one network for velocity and deviation, one norm for all steps, also of the time."""

import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.networks.dense import Dense
from hcpg.networks.flow import Noise, at_rest
from hcpg.networks.plain_actor import PlainActor, PlainMoments

OBSERVATIONS, ACTIONS, STEPS, ROWS = 5, 3, 4, 6
train = jax.jit(lambda actor, *rest: actor.train(*rest))
infer = jax.jit(lambda actor, *rest: actor.infer(*rest))


@pytest.fixture(scope="module")
def actor():
    return PlainActor.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), 8)


@pytest.fixture(scope="module")
def noise():
    return Noise.draw(jax.random.key(1), (ROWS, ACTIONS), STEPS)


@pytest.fixture(scope="module")
def observations():
    return jax.random.normal(jax.random.key(2), (ROWS, OBSERVATIONS))


def test_four_steps_are_four_calls_of_the_one_norm(actor, observations, noise):
    """The observation's mean moves as if seen four times; the time's is .01 (.75 + .99/2 + .99^2/4)."""
    _, after = train(actor, actor.moments(), observations, noise)
    assert int(after.inputs[0].calls) == 4
    mean = np.asarray(observations).mean(axis=0)
    np.testing.assert_allclose(
        after.inputs[0].mean[:OBSERVATIONS], mean * (1 - 0.99**4), rtol=1e-4, atol=1e-7
    )
    np.testing.assert_allclose(after.inputs[0].mean[-1], 0.01490025, rtol=1e-5)
    np.testing.assert_allclose(after.inputs[0].variance[-1], 0.99**4, rtol=1e-5)


def test_in_training_the_time_is_the_norms_bias_alone(actor, observations, noise):
    """With a bias of zero, what weighs the time changes nothing while learning, and a lot while acting."""
    louder = eqx.tree_at(lambda actor: actor.first.kernel, actor, actor.first.kernel.at[-1].add(3.0))
    moments = PlainMoments([actor.moments().inputs[0]._replace(mean=jnp.full(9, 0.375))])
    learning = [train(each, moments, observations, noise)[0].actions for each in (actor, louder)]
    acting = [infer(each, moments, observations, noise).actions for each in (actor, louder)]
    np.testing.assert_allclose(*learning, atol=1e-4)
    assert float(abs(acting[0] - acting[1]).max()) > 0.1


def test_velocity_and_deviation_are_the_heads_outputs(actor, observations, noise):
    """Kernels of zero leave the heads' biases: velocity 0.8, log-deviation -1.5 + 3.5 tanh(0.4)."""
    flat = eqx.tree_at(
        lambda actor: (actor.velocity, actor.deviation),
        actor,
        (Dense.constant(8, ACTIONS, 0.8), Dense.constant(8, ACTIONS, 0.4)),
    )
    drive, moments = flat.begin(flat.moments(), observations, STEPS, at_rest)
    push, _ = flat.push(drive, 1, noise.start, moments, at_rest)
    np.testing.assert_allclose(push.velocity, np.full((ROWS, ACTIONS), 0.8), rtol=1e-6)
    np.testing.assert_allclose(
        push.log_deviation, np.full((ROWS, ACTIONS), -1.5 + 3.5 * np.tanh(0.4)), rtol=1e-5
    )
    np.testing.assert_array_equal(push.counted, push.log_deviation)


def test_the_deviation_depends_on_observation_sample_and_time(actor, observations, noise):
    drive, moments = actor.begin(actor.moments(), observations, STEPS, at_rest)

    def deviations(step, sample, drive=drive):
        return actor.push(drive, step, sample, moments, at_rest)[0].log_deviation

    still = deviations(0, noise.start)
    other = drive._replace(observations=observations + 1.0)
    for changed in (
        deviations(3, noise.start),
        deviations(0, noise.start + 1.0),
        deviations(0, noise.start, other),
    ):
        assert float(abs(changed - still).max()) > 1e-2


def test_one_observation_serves_many_proposals_each_as_if_alone(actor, observations, noise):
    moments, one = actor.moments(), observations[:1]
    every = infer(actor, moments, jnp.broadcast_to(one, observations.shape), noise)
    np.testing.assert_allclose(infer(actor, moments, one, noise).actions, every.actions, atol=1e-6)
    alone = infer(actor, moments, one, Noise(noise.start[2:3], noise.steps[:, 2:3]))
    np.testing.assert_allclose(alone.actions[0], every.actions[2], atol=1e-6)
    np.testing.assert_allclose(alone.log_prob[0], every.log_prob[2], rtol=1e-5)


def test_the_parameters_are_those_of_the_published_network():
    """Observation 10, action 4, width 512: norm 30, layers 16 x 512 and 513 x 512, two heads of 513 x 4."""
    actor = PlainActor.create(jax.random.key(0), (10, 4), 512)
    assert sum(leaf.size for leaf in jax.tree.leaves(actor)) == 30 + 16 * 512 + 513 * 512 + 2 * 513 * 4


def test_a_norm_for_each_step_acts_by_the_moments_it_learned_by(observations, noise):
    """After many calls with one batch, acting on it is what training did; with one norm it is not."""
    apart = {}
    for norms in (1, STEPS):
        actor = PlainActor.create(jax.random.key(0), (OBSERVATIONS, ACTIONS), 8, norms)
        moments = actor.moments()
        for _ in range(1500):  # 0.99^1500 is below 3e-7
            path, moments = train(actor, moments, observations, noise)
        acted = infer(actor, moments, observations, noise)
        apart[norms] = float(abs(path.actions - acted.actions).max())
        assert [int(each.calls) for each in moments.inputs] == [1500 * STEPS // norms] * norms
    assert apart[STEPS] < 1e-4
    assert apart[1] > 0.1
