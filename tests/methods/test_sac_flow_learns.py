"""HCPG-Flow learns the point suite from scratch, and early on it is the selector that acts well.

SAC-Flow's other fields learn it without a selector.
"""

from statistics import mean

import pytest
from training import successes, trained

# Rewards lie in [0, 1] and the path's entropy starts near 20 nats, hence the small temperature.
LEARNER = {
    "actor_hidden_size": 64,
    "critic_hidden_size": 64,
    "actor_learning_rate": 1e-3,
    "target_entropy": 0.0,
    "initial_temperature": 0.01,
    "discount": 0.95,
}


def test_it_learns_to_reach_with_the_selector_and_without(tmp_path):
    found = trained("point/reach", "hcpg_flow", tmp_path, LEARNER, steps=8000, evaluations=4)
    steps = (2000, 4000, 6000, 8000)
    curve = {name: [successes(found[step, name]) for step in steps] for name in ("hcpg", "bare")}
    assert curve["hcpg"][-1] >= 17, curve  # of 20
    assert curve["bare"][-1] >= 15, curve
    assert curve["hcpg"][0] > curve["bare"][0], curve


def test_early_in_carrying_the_selector_earns_a_multiple_of_what_the_bare_actor_does(tmp_path):
    found = trained("point/carry", "hcpg_flow", tmp_path, LEARNER, steps=2400, evaluations=1)
    hcpg, bare = (mean(row["return"] for row in found[2400, name]) for name in ("hcpg", "bare"))
    assert hcpg > 2 * bare
    assert successes(found[2400, "bare"]) == 0


@pytest.mark.parametrize(("preset", "steps"), [("sac_flow_plain", 8000), ("sac_flow_decoder", 6000)])
def test_the_other_fields_learn_to_reach(preset, steps, tmp_path):
    learner = {**LEARNER, "decoder_hidden_size": 32}
    found = trained("point/reach", preset, tmp_path, learner, steps=steps, evaluations=steps // 2000)
    curve = [successes(found[step, "bare"]) for step in range(2000, steps + 1, 2000)]
    assert curve[0] <= 5, curve  # of 20
    assert max(curve[2:]) >= 12, curve
