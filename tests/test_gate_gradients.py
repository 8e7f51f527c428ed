"""The command that draws what the gate does to gradients: its measure against chains worked out by hand."""

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from jax import numpy as jnp

from hcpg.networks.dense import Dense
from hcpg.types import Batch

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))

import gate_gradients

STEPS, ROWS = 4, 5


def gains_of(velocity, flattened):
    """The measured gains of a fresh learner whose `flattened` layers ignore their inputs."""
    learner = gate_gradients.method(velocity, STEPS)
    state = learner.init(jax.random.key(0))
    size, hidden = learner.spec.action_size, learner.config.actor_hidden_size
    flat = [Dense.constant(hidden, size, 0.3) for _ in flattened(state.actor)]
    state = state._replace(actor=eqx.tree_at(flattened, state.actor, flat))
    observations = jax.random.normal(jax.random.key(1), (ROWS, learner.spec.observation_size))
    nothing = jnp.zeros(ROWS)
    batch = Batch(observations, jnp.zeros((ROWS, size)), nothing, observations, nothing)
    return jax.jit(lambda: gate_gradients.gains(learner, state, batch, jax.random.key(2)))()


def test_an_open_gate_shrinks_a_gradient_by_the_same_factor_at_every_step():
    """x' = x + z (h - x) / 4 with z = sigmoid(5) and a constant h: each step leaves 1 - z / 4."""
    factor = 1 - 1 / (1 + math.exp(-5)) / STEPS
    expected = [factor ** (STEPS - step) for step in range(STEPS + 1)]
    np.testing.assert_allclose(gains_of("gated", lambda actor: [actor.field.candidate]), expected, rtol=1e-4)


def test_a_velocity_that_ignores_the_sample_leaves_gradients_as_they_are():
    found = gains_of("plain", lambda actor: [actor.velocity, actor.deviation])
    np.testing.assert_allclose(found, np.ones(STEPS + 1), rtol=1e-4)


def test_the_table_gives_the_mean_over_seeds_and_their_range():
    measured = {
        "gain": [[[0.2, 1.0]] * 10, [[0.4, 1.0]] * 10],
        "actor_gradient": [[1.0] * 5 + [3.0] * 5, [2.0] * 5 + [4.0] * 5],
    }
    row = gate_gradients.table({"gated 1": measured}).splitlines()[-1]
    assert row == (
        "| gated 1 | 0.30 (0.20 to 0.40) | 0.30 (0.20 to 0.40) | 1.50 (1.00 to 2.00) | 3.50 (3.00 to 4.00) |"
    )


def test_it_writes_a_picture_of_every_field_and_number_of_steps(tmp_path):
    results = {
        f"{velocity} {steps}": {
            "gain": np.ones((2, 6, steps + 1)).tolist(),
            "actor_gradient": np.ones((2, 6)).tolist(),
        }
        for velocity in gate_gradients.FIELDS
        for steps in gate_gradients.FLOW_STEPS
    }
    gate_gradients.draw(results, tmp_path / "gains.png")
    assert (tmp_path / "gains.png").stat().st_size > 10_000


def test_the_stored_table_and_settings_are_those_of_the_stored_numbers_and_of_today():
    folder = Path(__file__).parents[1] / "docs/evidence/gate_gradients"
    stored = json.loads((folder / "numbers.json").read_text())
    assert gate_gradients.table(stored["results"]) in (folder / "README.md").read_text()
    for name, settings in stored["settings"].items():
        velocity, steps = name.split()
        now = asdict(gate_gradients.method(velocity, int(steps)).config)
        assert settings == {setting: now[setting] for setting in settings}
        # These came later; their defaults are what was measured.
        assert now.keys() - settings.keys() <= {"plain_norm", "polyak_inputs", "imitation"}
        assert (now["plain_norm"], now["polyak_inputs"], now["imitation"]) == ("shared", "standardised", 0.0)
