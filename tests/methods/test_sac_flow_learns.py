"""HCPG-Flow learns the point suite from scratch, and early on it is the selector that acts well."""

from dataclasses import replace
from statistics import mean

from hcpg import presets
from hcpg.loops import sitting


def trained(task, root, steps, evaluations):
    """The evaluation rows of one run, by step and selector.

    Rewards lie in [0, 1] and the path's entropy starts near 20 nats, hence the small temperature.
    """
    chosen = presets.settings(task, "hcpg_flow", "cpu")
    learner = replace(
        chosen.learner,
        actor_hidden_size=64,
        critic_hidden_size=64,
        actor_learning_rate=1e-3,
        target_entropy=0.0,
        initial_temperature=0.01,
        discount=0.95,
    )
    budget = replace(
        chosen.budget,
        steps=steps,
        environments=8,
        updates_per_step=0.5,
        warmup_steps=1000,
        batch_size=128,
        evaluations=evaluations,
        evaluation_episodes=20,
        replay_capacity=16_000,
    )
    settings = replace(chosen, learner=learner, budget=budget)
    [folder] = sitting.create_folders(settings, [0], root)
    assert sitting.sit(settings, [folder], 1, lambda event: None, lambda: False) == [True]
    rows = [row for row in folder.rows("episodes") if row["phase"] == "evaluation"]
    return {
        (step, name): [row for row in rows if (row["step"], row["selector"]) == (step, name)]
        for step in {row["step"] for row in rows}
        for name in ("hcpg", "bare")
    }


def successes(rows):
    return sum(row["success_once"] for row in rows)


def test_it_learns_to_reach_with_the_selector_and_without(tmp_path):
    found = trained("point/reach", tmp_path, steps=8000, evaluations=4)
    steps = (2000, 4000, 6000, 8000)
    curve = {name: [successes(found[step, name]) for step in steps] for name in ("hcpg", "bare")}
    assert curve["hcpg"][-1] >= 17, curve  # of 20
    assert curve["bare"][-1] >= 15, curve
    assert curve["hcpg"][0] > curve["bare"][0], curve


def test_early_in_carrying_the_selector_earns_a_multiple_of_what_the_bare_actor_does(tmp_path):
    found = trained("point/carry", tmp_path, steps=2400, evaluations=1)
    hcpg, bare = (mean(row["return"] for row in found[2400, name]) for name in ("hcpg", "bare"))
    assert hcpg > 2 * bare
    assert successes(found[2400, "bare"]) == 0
