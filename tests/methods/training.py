"""One short training run through the real trainer, for tests that a preset learns."""

from contextlib import contextmanager
from dataclasses import replace

import jax

from hcpg import presets
from hcpg.loops import sitting

BUDGET = {
    "environments": 8,
    "updates_per_step": 0.5,
    "warmup_steps": 1000,
    "batch_size": 128,
    "evaluation_episodes": 20,
    "replay_capacity": 16_000,
}


@contextmanager
def _optimised():
    """Programs that run for half a minute repay the optimisations that tests go without."""
    jax.config.update("jax_disable_most_optimizations", False)
    try:
        yield
    finally:
        jax.config.update("jax_disable_most_optimizations", True)


def trained(task, preset, root, learner, steps, evaluations):
    """The evaluation rows of seed 0, by (step, selector), of `preset` with the `learner` settings changed."""
    chosen = presets.settings(task, preset, "cpu")
    budget = replace(chosen.budget, steps=steps, evaluations=evaluations, **BUDGET)
    settings = replace(chosen, learner=replace(chosen.learner, **learner), budget=budget)
    [folder] = sitting.create_folders(settings, [0], root)
    with _optimised():
        assert sitting.sit(settings, [folder], 1, lambda event: None, lambda: False) == [True]
    rows = [row for row in folder.rows("episodes") if row["phase"] == "evaluation"]
    kinds = {(row["step"], row["selector"]) for row in rows}
    return {kind: [row for row in rows if (row["step"], row["selector"]) == kind] for kind in kinds}


def successes(rows):
    """How many of the episodes succeeded at least once."""
    return sum(row["success_once"] for row in rows)
