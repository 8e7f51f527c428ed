"""Which runs make up a table: tasks, presets, seeds and a budget, chosen before anything is trained."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from hcpg import presets, registry
from hcpg.presets import ARMS, Settings

Changes = Mapping[str, Any]

METAWORLD = tuple(
    f"metaworld/{name}"
    for name in ("button-press", "door-open", "drawer-open", "lever-pull", "peg-insert-side", "sweep-into")
)
"""The paper's six."""
MANISKILL = tuple(f"maniskill/{name}" for name in ("pick-cube", "push-cube", "poke-cube", "pull-cube"))
"""The paper's four."""
ABLATED = tuple(f"maniskill/{name}" for name in ("pick-cube", "push-cube", "pull-cube"))
"""The three of the paper's ablation."""
CONTROLLED = tuple(f"metaworld/{name}" for name in ("drawer-open", "button-press", "door-open"))
BASELINES = ("sac", "flowrl", "qsm", "sac_flow")

# ManiSkill's own recipe for training from states: 32 environments, one update for two steps, discount 0.8,
# a million steps for PickCube and half of that for the easier tasks; warm-up is 5 % of the steps.
MANISKILL_LEARNER = {"discount": 0.8}
MANISKILL_PAPER = {
    "steps": 500_000,
    "environments": 32,
    "updates_per_step": 0.5,
    "warmup_steps": 25_000,
    "evaluation_episodes": 16,
}
MANISKILL_STEPS = {
    "paper": {"maniskill/pick-cube": {"steps": 1_000_000, "warmup_steps": 50_000}},
    "cpu": {f"maniskill/{name}": {"steps": 300_000} for name in ("pick-cube", "poke-cube")},
}


class Cell(NamedTuple):
    """One run of an experiment."""

    settings: Settings
    seed: int

    def identity(self) -> tuple[str, int]:
        """What a run must have to be the cell's: its whole configuration, and its seed."""
        return json.dumps(self.settings.as_json(), sort_keys=True), self.seed


@dataclass(frozen=True)
class Protocol:
    """Every preset on every task with the same seeds; all presets get the same budget on a task."""

    title: str
    tasks: tuple[str, ...]
    presets: tuple[str, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    budget: str = "cpu"
    adapter: str = "paper"
    changes: Changes = field(default_factory=dict)
    """Values of the budget that differ from the named one."""
    task_changes: Mapping[str, Changes] = field(default_factory=dict)
    """Further ones of single tasks, which go before `changes`."""
    learner: Changes = field(default_factory=dict)
    """Values of the learner that are the same for all presets, whatever theirs are."""

    def settings(self) -> list[Settings]:
        """One for each task and preset, in the order of the table."""
        return [self._settings(task, preset) for task in self.tasks for preset in self.presets]

    def cells(self) -> list[Cell]:
        """All runs, seed by seed: what is there after an interruption covers the whole table."""
        return [Cell(each, seed) for seed in self.seeds for each in self.settings()]

    def _settings(self, task: str, preset: str) -> Settings:
        usual = presets.settings(task, preset, self.budget)
        changes = {**self.changes, **self.task_changes.get(task, {})}
        return replace(
            usual,
            adapter=self.adapter,
            learner=replace(usual.learner, **self.learner),
            budget=replace(usual.budget, **changes),
        )


def _metaworld(
    title: str, tasks: tuple[str, ...], names: tuple[str, ...], **other: Any
) -> dict[str, Protocol]:
    """The table at both budgets, by budget."""
    return {budget: Protocol(title, tasks, names, budget=budget, **other) for budget in ("cpu", "paper")}


def _maniskill(title: str, tasks: tuple[str, ...], names: tuple[str, ...]) -> dict[str, Protocol]:
    return {
        budget: Protocol(
            title,
            tasks,
            names,
            budget=budget,
            changes=MANISKILL_PAPER if budget == "paper" else {},
            task_changes={task: each for task, each in MANISKILL_STEPS[budget].items() if task in tasks},
            learner=MANISKILL_LEARNER,
        )
        for budget in ("cpu", "paper")
    }


SMOKE = Protocol(
    "Two presets on a task without simulator and one with, minutes on two cores",
    ("point/reach", "metaworld/drawer-open"),
    ("sac_flow", "hcpg_flow"),
    seeds=(0, 1),
    changes={"steps": 4000, "warmup_steps": 1000, "evaluations": 5, "evaluation_episodes": 4},
)
TABLES = {
    "metaworld": _metaworld("Meta-World, main table", METAWORLD, (*BASELINES, "hcpg_flow")),
    "maniskill": _maniskill(
        "ManiSkill, main table; QSM too, which the paper omits as unstable",
        MANISKILL,
        ("flowrl", "qsm", "sac_flow", "hcpg_flow"),
    ),
    "ablation": _maniskill(
        "Selection rule and candidate count",
        ABLATED,
        ("sac_flow", "q_guided", "hcpg_k2", "hcpg_flow", "hcpg_k8"),
    ),
    "k_sensitivity": _maniskill(
        "Sensitivity to the candidate count", ABLATED, ("hcpg_k2", "hcpg_flow", "hcpg_k8")
    ),
    "controls": _metaworld(
        "Where HCPG's gain comes from, Meta-World", CONTROLLED, ("sac_flow", "hcpg_flow", *ARMS)
    ),
    "maniskill_controls": _maniskill(
        "Where HCPG's gain comes from, ManiSkill", ABLATED, ("sac_flow", "hcpg_flow", *ARMS)
    ),
    "contact": _metaworld(
        "What more task knowledge brings: our `contact` adapters",
        CONTROLLED,
        ("sac_flow", "hcpg_flow"),
        adapter="contact",
    ),
}
PROTOCOLS = {"smoke": SMOKE} | {
    name if budget == "cpu" else f"{name}_{budget}": each
    for name, table in TABLES.items()
    for budget, each in table.items()
}
"""By name: a table at the budget `cpu`, or with `_paper` behind its name at that one."""


def protocol(name: str) -> Protocol:
    """The protocol with this name.

    Raises:
        UnknownNameError: there is none; the message lists those there are.
    """
    if name not in PROTOCOLS:
        raise registry.UnknownNameError("experiment", name, sorted(PROTOCOLS))
    return PROTOCOLS[name]
