"""Learning on an arm: the paper's budgets, and the learner's settings that both methods share."""

from dataclasses import replace

from hcpg import presets
from hcpg.presets import Budget, Settings

PAPER_ACTIONS = {
    "franka/peg-insertion": 1200,
    "franka/button-press": 1000,
    "franka/drawer-closing": 400,
    "franka/rugby-grasp": 1000,
}
"""Environment steps of online learning on the arm, by task: all that the paper says of its recipe."""
OTHERS = 300
"""Of tasks that the paper has not."""

# An episode has at most one reward of 1, so the temperature begins where entropy does not drown it; critics
# with LayerNorm and targets, since thousands of updates see a few hundred actions (docs/robot_learning.md).
LEARNER = {
    "critic_learning_rate": 3e-4,
    "actor_learning_rate": 1e-4,
    "temperature_learning_rate": 3e-4,
    "initial_temperature": 0.001,
    "target_entropy": 0.0,
    "momentum": 0.9,
    "policy_delay": 2,
    "discount": 0.97,
}
FLOW_LEARNER = {"critic": "polyak", "imitation": 1.0}
"""Of a method whose actor is a flow. Without imitation critics that have seen little but demonstrations lead
the actor away from them within 500 updates, and it does not come back (docs/robot_learning.md)."""


def settings(task: str, preset: str, actions: int | None = None, updates_per_action: int = 4) -> Settings:
    """The full settings of a run; `actions` is its budget, None the paper's.

    Raises:
        UnknownNameError: the preset does not exist.
    """
    usual = presets.settings(task, preset, "cpu")
    served = {**LEARNER, **(FLOW_LEARNER if hasattr(usual.learner, "flow_steps") else {})}
    learner = {name: value for name, value in served.items() if hasattr(usual.learner, name)}
    steps = PAPER_ACTIONS.get(task, OTHERS) if actions is None else actions
    budget = Budget(
        "arm",
        steps=steps,
        environments=1,
        updates_per_step=float(updates_per_action),
        warmup_steps=0,
        batch_size=256,
        evaluations=1,
        evaluation_episodes=20,
        replay_capacity=steps,
    )
    return replace(usual, learner=replace(usual.learner, **learner), budget=budget)
