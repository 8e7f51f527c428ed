"""SAC learns the point suite from scratch, with its own critics and with CrossQ's."""

import pytest
from training import successes, trained

# Raw positions in metres differ by centimetres: it takes large steps, and noise that lasts a while.
LEARNER = {
    "actor_hidden_size": 64,
    "critic_hidden_size": 64,
    "actor_learning_rate": 3e-3,
    "critic_learning_rate": 3e-3,
    "initial_temperature": 0.1,
    "discount": 0.95,
}


@pytest.mark.parametrize("preset", ["sac", "sac_crossq"])
def test_it_learns_to_reach(preset, tmp_path):
    found = trained("point/reach", preset, tmp_path, LEARNER, steps=10_000, evaluations=5)
    assert set(found) == {(step, "bare") for step in (2000, 4000, 6000, 8000, 10_000)}
    curve = [successes(found[step, "bare"]) for step in (2000, 10_000)]  # of 20
    assert curve[0] <= 3, curve
    assert curve[1] >= 18, curve
