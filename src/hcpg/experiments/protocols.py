"""Which runs make up a table: tasks, presets, seeds and a budget, chosen before anything is trained."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from hcpg import presets, registry
from hcpg.presets import ARMS, Settings

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

# As ManiSkill trains from states: 32 environments, one update for two steps; and the paper's 16 episodes per
# evaluation. One length for all tasks of a table. On a CPU it was chosen before any run of a table, from
# single runs (docs/maniskill.md): PushCube and PullCube are learned by then, PickCube and PokeCube begin to
# be; three times as many would make the suite's tables 110 core-hours instead of 37.
MANISKILL_CHANGES = {
    "paper": {"environments": 32, "updates_per_step": 0.5, "evaluation_episodes": 16},
    "cpu": {"steps": 100_000},
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
    """Every preset on every task, with the same seeds and budget."""

    title: str
    tasks: tuple[str, ...]
    presets: tuple[str, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    budget: str = "cpu"
    adapter: str = "paper"
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Values of the budget that differ from the named one."""

    def settings(self) -> list[Settings]:
        """One for each task and preset, in the order of the table."""
        return [self._settings(task, preset) for task in self.tasks for preset in self.presets]

    def cells(self) -> list[Cell]:
        """All runs, seed by seed: what is there after an interruption covers the whole table."""
        return [Cell(each, seed) for seed in self.seeds for each in self.settings()]

    def only(self, tasks: Sequence[str], presets: Sequence[str]) -> "Protocol":
        """The part with these tasks and presets, in the table's order; with all where none is named.

        Raises:
            UnknownNameError: the table has no such task or preset.
        """
        for kind, asked, known in (("task", tasks, self.tasks), ("preset", presets, self.presets)):
            for name in asked:
                if name not in known:
                    raise registry.UnknownNameError(f"{kind} of this experiment", name, list(known))
        return replace(
            self,
            tasks=tuple(each for each in self.tasks if not tasks or each in tasks),
            presets=tuple(each for each in self.presets if not presets or each in presets),
        )

    def _settings(self, task: str, preset: str) -> Settings:
        usual = presets.settings(task, preset, self.budget)
        return replace(usual, adapter=self.adapter, budget=replace(usual.budget, **self.changes))


def _metaworld(
    title: str, tasks: tuple[str, ...], names: tuple[str, ...], **other: Any
) -> dict[str, Protocol]:
    """The table at both budgets, by budget."""
    return {budget: Protocol(title, tasks, names, budget=budget, **other) for budget in ("cpu", "paper")}


def _maniskill(title: str, tasks: tuple[str, ...], names: tuple[str, ...]) -> dict[str, Protocol]:
    return {
        budget: Protocol(title, tasks, names, budget=budget, changes=changes)
        for budget, changes in MANISKILL_CHANGES.items()
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
