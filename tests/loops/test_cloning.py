"""Cloning: the clone's samples lie at the actions that were shown, acting and learning."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg.experiments import arm_budgets
from hcpg.loops import cloning
from hcpg.loops.checkpoints import latest, load
from hcpg.loops.cloning import NotClonableError, Recipe
from hcpg.loops.demonstrations import Demonstrations
from hcpg.networks.flow import Noise
from hcpg.networks.gated_actor import GatedActor
from hcpg.networks.velocity import OPEN_GATE_BIAS
from hcpg.types import Batch

STEPS, ROWS, ASKED = 4, 512, 400
RECIPE = Recipe(steps=1000, batch_size=64, learning_rate=2e-2, deviation=0.05)


def shown():
    """Of two numbers the first is -0.6 or 0.6, whatever is seen; the second is half of what is seen."""
    generator = np.random.default_rng(0)
    seen = generator.uniform(-1, 1, (ROWS, 1)).astype(np.float32)
    first = np.where(generator.uniform(size=(ROWS, 1)) < 0.5, -0.6, 0.6)
    actions = np.concatenate([first, 0.5 * seen], axis=1).astype(np.float32)
    nothing = np.zeros(ROWS, np.float32)
    return Batch(seen, actions, nothing, seen, nothing)


@pytest.fixture(scope="module")
def cloned():
    actor = GatedActor.create(jax.random.key(0), (1, 2), 32)
    return cloning.matched(actor, STEPS, shown(), RECIPE, seed=0)[:2]


@pytest.fixture(scope="module")
def sampled(cloned):
    """What is seen, and the first and second numbers that the clone then gives: acting, and learning."""
    noise = Noise.draw(jax.random.key(5), (ASKED, 2), STEPS)
    acting, learning = np.full(ASKED, 0.8), np.linspace(-1, 1, ASKED)

    @jax.jit
    def both(actor, moments):
        infer = actor.infer(moments, jnp.asarray(acting, jnp.float32)[:, None], noise)
        return infer.actions, actor.train(moments, jnp.asarray(learning, jnp.float32)[:, None], noise)[
            0
        ].actions

    return [
        (seen, *np.asarray(found).T) for seen, found in zip((acting, learning), both(*cloned), strict=True)
    ]


@pytest.mark.parametrize("mode", [0, 1], ids=["acting", "learning"])
def test_it_takes_both_ways_shown_and_hits_what_follows_from_the_sight(sampled, mode):
    """Four Euler steps of the exact velocity bring 84 % of these paths within 0.15 of a way."""
    seen, first, second = sampled[mode]
    assert 0.35 < (first > 0).mean() < 0.65
    assert (np.abs(np.abs(first) - 0.6) < 0.15).mean() > 0.60
    assert np.abs(second - 0.5 * seen).mean() < 0.05


def test_its_gate_stays_as_open_as_it_was(cloned):
    gate = cloned[0].field.gate
    np.testing.assert_array_equal(gate.kernel, 0.0)
    np.testing.assert_array_equal(gate.bias, OPEN_GATE_BIAS)


def test_the_step_noise_is_the_recipes(cloned):
    actor, _ = cloned
    deviations = np.exp(actor.deviation.log(jnp.linspace(-1, 1, 9)[:, None]))
    assert deviations == pytest.approx(np.full((9, 2), 0.05), rel=0.15)


def small(preset="hcpg_flow"):
    full = arm_budgets.settings("point/reach", preset)
    sizes = {name: 8 for name in vars(full.learner) if name.endswith("hidden_size")}
    return replace(full, learner=replace(full.learner, **sizes), budget=replace(full.budget, batch_size=16))


def some(tmp_path):
    generator = np.random.default_rng(1)
    seen, actions = generator.normal(size=(64, 11)), generator.uniform(-1, 1, (64, 4))
    rows = [seen, actions, np.full(64, -0.01), seen, np.zeros(64)]
    return Demonstrations(tmp_path, {"sha256": "abc"}, Batch(*(each.astype(np.float32) for each in rows)))


def test_the_clone_is_a_run_with_warm_critics_and_no_update_counted(tmp_path):
    recipe = Recipe(steps=cloning.CHUNK, batch_size=16, critic_updates=cloning.CHUNK)
    folder = cloning.clone(small(), some(tmp_path), recipe, 3, tmp_path)
    assert (folder.status()["state"], folder.status()["step"]) == ("finished", 0)
    from hcpg.loops.trained import Choice
    from hcpg.loops.trained import load as load_trained

    trained = load_trained(folder.path, Choice())
    assert (trained.step, trained.name, int(trained.states.updates)) == (0, "hcpg", 0)
    fresh = jax.jit(trained.method.init)(jax.random.fold_in(jax.random.key(3), 0))
    changed = jax.tree.map(lambda new, old: bool((new[0] != old).any()), trained.states.critic, fresh.critic)
    assert all(jax.tree.leaves(changed.networks))
    assert float(trained.states.log_temperature[0]) == pytest.approx(np.log(0.001))
    found = load(latest(folder.checkpoints), {})[1]
    assert found == {"demonstrations": "abc"}


def test_a_method_without_a_flow_cannot_be_cloned(tmp_path):
    with pytest.raises(NotClonableError, match="'sac' has no flow actor"):
        cloning.clone(small("sac"), some(tmp_path), RECIPE, 0, tmp_path)
