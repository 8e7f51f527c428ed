"""Which runs make up a table: tasks, presets, seeds and a budget, chosen before anything is trained."""

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from hcpg import presets, registry
from hcpg.presets import ARMS, Settings

METAWORLD = tuple(
    f"metaworld/{name}"
    for name in ("button-press", "door-open", "drawer-open", "lever-pull", "peg-insert-side", "sweep-into")
)
"""The paper's six."""
BASELINES = ("sac", "flowrl", "qsm", "sac_flow")


class Cell(NamedTuple):
    """One run of an experiment."""

    settings: Settings
    seed: int


@dataclass(frozen=True)
class Protocol:
    """Every preset on every task, with the same seeds and budget."""

    title: str
    tasks: tuple[str, ...]
    presets: tuple[str, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    budget: str = "cpu"
    changes: dict[str, Any] = field(default_factory=dict)
    """Values of the budget that differ from the named one."""

    def settings(self) -> list[Settings]:
        """One for each task and preset, in the order of the table."""
        chosen = [
            presets.settings(task, preset, self.budget) for task in self.tasks for preset in self.presets
        ]
        return [replace(each, budget=replace(each.budget, **self.changes)) for each in chosen]

    def cells(self) -> list[Cell]:
        """All runs, seed by seed: what is there after an interruption covers the whole table."""
        return [Cell(each, seed) for seed in self.seeds for each in self.settings()]


PROTOCOLS = {
    "smoke": Protocol(
        "Two presets on a task without simulator and one with, minutes on two cores",
        ("point/reach", "metaworld/drawer-open"),
        ("sac_flow", "hcpg_flow"),
        seeds=(0, 1),
        changes={"steps": 4000, "warmup_steps": 1000, "evaluations": 5, "evaluation_episodes": 4},
    ),
    "metaworld": Protocol("Meta-World, main table", METAWORLD, (*BASELINES, "hcpg_flow")),
    "metaworld_paper": Protocol(
        "Meta-World, main table, the paper's budget", METAWORLD, (*BASELINES, "hcpg_flow"), budget="paper"
    ),
    "controls": Protocol(
        "Where HCPG's gain comes from",
        ("metaworld/drawer-open", "metaworld/button-press", "metaworld/door-open"),
        ("sac_flow", "hcpg_flow", *ARMS),
        seeds=(0, 1, 2, 3, 4),
    ),
}
"""By name. Those of ManiSkill come with its suite."""


def protocol(name: str) -> Protocol:
    """The protocol with this name.

    Raises:
        UnknownNameError: there is none; the message lists those there are.
    """
    if name not in PROTOCOLS:
        raise registry.UnknownNameError("experiment", name, sorted(PROTOCOLS))
    return PROTOCOLS[name]
