"""The paper's main table from run folders: last-five success per task and method, as LaTeX, Markdown and CSV.

Source: paper, tables of Meta-World and ManiSkill success. Rows of tasks have the SD over seeds, the last row
that over the tasks' means; both are sample SDs, and neither is a confidence interval.
"""

import csv
import io
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from hcpg.report.booktabs import booktabs
from hcpg.report.protocol import one_protocol
from hcpg.report.records import Group
from hcpg.report.statistics import Spread, StatisticsError, last_five, spread
from hcpg.report.tables import aligned

METHODS = {
    "sac": "SAC",
    "flowrl": "FlowRL",
    "qsm": "QSM",
    "sac_flow": "SAC-Flow",
    "q_guided": "Q-guided K=4",
    "hcpg_k2": "HCPG K=2",
    "hcpg_flow": "HCPG-Flow",
    "hcpg_k8": "HCPG K=8",
}
"""Presets by the paper's names, in the order of its columns; others follow under their own."""
ACROSS = "Across-task mean"


class MainTable(NamedTuple):
    """Percent, by task and method."""

    tasks: list[str]
    methods: list[str]
    cells: dict[tuple[str, str], Spread]
    """By (task, method); a pair that has no runs is not there."""
    across: dict[str, Spread]
    """By method, for methods that have every task; none where there is one task alone."""
    protocol: dict[str, str]
    """What all runs have alike: budget, steps, adapter, evaluation episodes, seeds."""


def main_table(groups: Sequence[Group]) -> MainTable:
    """The table of all groups, evaluated with their own selectors.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    protocol = one_protocol(groups)
    names = task_names(group.task for group in groups)
    cells = {(names[group.task], method_name(group.preset)): _last_five(group) for group in groups}
    tasks = sorted({task for task, _ in cells})
    known = [*METHODS.values(), *sorted({method for _, method in cells} - set(METHODS.values()))]
    methods = [name for name in known if any(method == name for _, method in cells)]
    across = {
        method: spread(np.array([cells[task, method].mean for task in tasks]))
        for method in methods
        if len(tasks) > 1 and all((task, method) in cells for task in tasks)
    }
    return MainTable(tasks, methods, cells, across, protocol)


def _last_five(group: Group) -> Spread:
    curve = group.curve(group.selector)
    assert curve is not None  # `one_protocol` refuses such a group
    try:
        return spread(100 * last_five(curve.rates))
    except StatisticsError as error:
        raise StatisticsError(f"{group.preset} on {group.task}: {error}") from error


def task_name(task: str) -> str:
    """`metaworld/button-press` as the paper writes it: ButtonPress."""
    return "".join(word.capitalize() for word in task.rpartition("/")[2].split("-"))


def task_names(tasks: Iterable[str]) -> dict[str, str]:
    """Every task's name; tasks of two suites that would have the same one keep their own."""
    names = {task: task_name(task) for task in tasks}
    counts = Counter(names.values())
    return {task: name if counts[name] == 1 else task for task, name in names.items()}


def method_name(preset: str) -> str:
    """A preset as the paper names it, or by its own name."""
    return METHODS.get(preset, preset)


def markdown(table: MainTable) -> str:
    """As Markdown, with the protocol in a line below."""
    rows = [["Task", *table.methods], *_rows(table, "{} ± {}", "**{}**", "-")]
    return f"{aligned(rows)}\n\n{_note(table)}\n"


def as_csv(table: MainTable) -> str:
    """As CSV with a column each for mean and SD."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["task", "method", "mean", "sd", *table.protocol])
    named = {**table.cells, **{(ACROSS, method): each for method, each in table.across.items()}}
    for (task, method), each in named.items():
        writer.writerow([task, method, f"{each.mean:.4f}", f"{each.deviation:.4f}", *table.protocol.values()])
    return file.getvalue()


def latex(table: MainTable) -> str:
    r"""As LaTeX with booktabs rules, the best mean of every row in bold; needs \usepackage{booktabs}."""
    rows = _rows(table, r"{} $\pm$ {}", r"\textbf{{{}}}", "--")
    blocks = [rows[: len(table.tasks)], rows[len(table.tasks) :]]
    return booktabs(["Task", *table.methods], [block for block in blocks if block], _note(table))


def _rows(table: MainTable, form: str, best: str, absent: str) -> list[list[str]]:
    """A row per task and one across several; the best printed means of a row with several are marked."""
    rows = [[table.cells.get((task, method)) for method in table.methods] for task in table.tasks]
    if len(table.tasks) > 1:
        rows.append([table.across.get(method) for method in table.methods])
    texts = []
    for name, row in zip([*table.tasks, ACROSS], rows, strict=False):
        means = [round(each.mean, 1) for each in row if each is not None]
        top = max(means) if len(means) > 1 else None
        cells = [absent if each is None else form.format(*_printed(each)) for each in row]
        marked = [
            best.format(cell) if each is not None and round(each.mean, 1) == top else cell
            for cell, each in zip(cells, row, strict=True)
        ]
        texts.append([name, *marked])
    return texts


def _printed(each: Spread) -> tuple[str, str]:
    return f"{each.mean:.1f}", "n/a" if np.isnan(each.deviation) else f"{each.deviation:.1f}"


def _note(table: MainTable) -> str:
    facts = ", ".join(f"{name} {value}" for name, value in table.protocol.items())
    return (
        f"Last-five success, percent, mean and sample SD (rows: over seeds; last row: over tasks); {facts}."
    )
