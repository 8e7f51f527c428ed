"""QSM learns the point suite from scratch; where its numbers overflow, its run is reported as diverged."""

from dataclasses import replace

from training import BUDGET, successes, trained

from hcpg import presets
from hcpg.loops import sitting

# As for SAC: raw positions in metres differ by centimetres, which takes large steps.
LEARNER = {
    "actor_hidden_size": 64,
    "critic_hidden_size": 64,
    "actor_learning_rate": 3e-3,
    "critic_learning_rate": 3e-3,
    "discount": 0.95,
}


def test_it_learns_to_reach(tmp_path):
    found = trained("point/reach", "qsm", tmp_path, LEARNER, steps=8000, evaluations=4)
    assert set(found) == {(step, "bare") for step in (2000, 4000, 6000, 8000)}
    curve = [successes(found[step, "bare"]) for step in (2000, 4000, 6000, 8000)]  # of 20
    assert curve[0] <= 3, curve
    assert curve[-1] >= 17, curve


def test_a_target_that_overflows_ends_the_run_as_diverged(tmp_path):
    chosen = presets.settings("point/reach", "qsm", "cpu")
    budget = replace(chosen.budget, steps=1600, evaluations=1, **BUDGET)
    learner = replace(chosen.learner, **LEARNER, gradient_scale=1e30)
    settings = replace(chosen, learner=learner, budget=budget)
    [folder] = sitting.create_folders(settings, [0], tmp_path)
    assert sitting.sit(settings, [folder], 1, lambda event: None, lambda: False) == [False]
    status = folder.status()
    assert (status["state"], status["step"]) == ("diverged", 1008)  # one tick of eight after the warm-up
    assert status["quantity"].startswith("state.actor_optimizer[0].nu")
    assert all(row["phase"] != "evaluation" for row in folder.rows("episodes"))
    assert list(folder.checkpoints.iterdir()) == []
