"""What each part of the selector is worth: rules and candidate counts side by side, over tasks and seeds.

Source: paper, the tables of the selection ablation and of the sensitivity to K.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hcpg.report.paper_tables import METHODS, MainTable, main_table, method_name
from hcpg.report.protocol import one_protocol
from hcpg.report.records import BARE, Curve, Group
from hcpg.report.statistics import auc, final, last_five
from hcpg.types import Float

CANDIDATES = {"sac_flow": 1, "hcpg_k2": 2, "hcpg_flow": 4, "hcpg_k8": 8}
"""K of the presets that differ in nothing else; with one proposal there is nothing to select."""
METRICS = ("Last-5", "AUC", "Final")
_PAIR = {"sac_flow", "hcpg_flow"}
"""The backbone alone and under the paper's selector: between them the arms stand."""
_MEASURES: dict[str, Callable[[Curve], np.ndarray]] = {
    "Last-5": lambda curve: 100 * last_five(curve.rates),
    "AUC": lambda curve: auc(curve.steps, curve.rates),
    "Final": lambda curve: 100 * final(curve.rates),
}


class Variant(NamedTuple):
    """One preset on all tasks of the ablation."""

    preset: str
    runs: int
    """Task-seed runs there are."""
    seeds: dict[str, Float[np.ndarray, " S"]]
    """Percent by metric, each seed's mean over the tasks; empty unless every task is there."""


class Ablation(NamedTuple):
    """The variants, and what they have alike."""

    variants: list[Variant]
    runs: int
    """Task-seed runs of a complete variant."""
    tasks: list[str]
    protocol: dict[str, str]


def ablation_name(preset: str) -> str:
    """A preset as the ablation's tables name it: by its candidates."""
    return "HCPG K=4" if preset == "hcpg_flow" else method_name(preset)


def ablated(groups: Sequence[Group]) -> list[Group]:
    """The groups that belong into the ablation: the backbone under every selector, where one is an arm.

    An arm is any other preset that selects. Tasks are those that an arm was run on; there are none where no
    arm was.
    """
    arms = {(group.task, group.preset) for group in groups if group.preset not in _PAIR and _selects(group)}
    tasks, presets = {task for task, _ in arms}, {preset for _, preset in arms} | _PAIR
    return [group for group in groups if group.task in tasks and group.preset in presets]


def _selects(group: Group) -> bool:
    """Whether a selector acts in training or at evaluation."""
    in_training = group.runs[0].config.get("selector", {}).get("candidates", 1) > 1
    return in_training or group.selector != BARE


def ablation(groups: Sequence[Group]) -> Ablation:
    """The metrics of every preset among `groups`, in the paper's order.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    protocol = one_protocol(groups)
    tasks = sorted({group.task for group in groups})
    presets = {group.preset for group in groups}
    known = [preset for preset in METHODS if preset in presets]
    variants = [
        _variant(preset, [group for group in groups if group.preset == preset], len(tasks))
        for preset in [*known, *sorted(presets - {*known})]
    ]
    return Ablation(variants, len(tasks) * len(groups[0].runs), tasks, protocol)


def _variant(preset: str, groups: Sequence[Group], tasks: int) -> Variant:
    runs = sum(len(group.runs) for group in groups)
    if len(groups) < tasks:
        return Variant(preset, runs, {})
    curves = [curve for group in groups if (curve := group.curve(group.selector)) is not None]
    seeds = {
        name: np.mean([measure(curve) for curve in curves], axis=0) for name, measure in _MEASURES.items()
    }
    return Variant(preset, runs, seeds)


def candidate_table(groups: Sequence[Group]) -> MainTable | None:
    """Last-five success by task and K, for the presets that differ in K alone; None without two such.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    counted = [group for group in ablated(groups) if CANDIDATES.get(group.preset, 1) > 1]
    if len({group.preset for group in counted}) < 2:
        return None
    table = main_table(counted)
    names = {method_name(preset): ablation_name(preset) for preset in CANDIDATES}
    return table._replace(
        methods=[names[method] for method in table.methods],
        cells={(task, names[method]): each for (task, method), each in table.cells.items()},
        across={names[method]: each for method, each in table.across.items()},
    )
