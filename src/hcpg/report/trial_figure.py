"""Trials as a figure: success rates with Wilson's intervals, steps to the first hit; it says who moved."""

from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.paper_tables import method_name, task_name
from hcpg.report.styles import PAGE_IN, blank, styles_of
from hcpg.report.trial_forms import label
from hcpg.report.trial_table import TrialTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_IN = 2.3


def trial_figure(table: TrialTable) -> "Figure":
    """Two panels side by side, policies as marks, tasks along x.

    Raises:
        StyleError: more policies than can be told apart.
    """
    figure = blank(PAGE_IN, HEIGHT_IN)
    rates, steps = figure.subplots(1, 2)
    _marks(rates, table, "rate")
    rates.set_ylabel("success, %")
    rates.set_ylim(-4, 104)
    _marks(steps, table, "capped")
    steps.set_ylabel("steps, failures at the cap")
    steps.set_ylim(bottom=0)
    figure.suptitle(f"Trials: {label(table)}", fontsize=8)
    figure.legend(*rates.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def _marks(axes: "Axes", table: TrialTable, what: str) -> None:
    looks = styles_of(table.policies)
    places = np.linspace(-0.25, 0.25, len(table.policies)) if len(table.policies) > 1 else [0.0]
    for policy, aside in zip(table.policies, places, strict=True):
        known = [(x, table.cells[task, policy]) for x, task in enumerate(table.tasks)
                 if (task, policy) in table.cells]  # fmt: skip
        across = [x + aside for x, _ in known]
        values = [100 * cell.tally.rate if what == "rate" else cell.capped for _, cell in known]
        lower = [100 * (cell.tally.rate - cell.rate.low) if what == "rate" else 0.0 for _, cell in known]
        upper = [100 * (cell.rate.high - cell.tally.rate) if what == "rate" else 0.0 for _, cell in known]
        look = {"color": looks[policy].color, "marker": looks[policy].marker, "markersize": 4.5}
        # Rounding may leave a bound a hair on the wrong side of a rate of 0 or 1.
        bars = np.maximum([lower, upper], 0.0)
        axes.errorbar(across, values, bars, linestyle="", label=method_name(policy), capsize=2, **look)
    axes.set_xticks(range(len(table.tasks)), [task_name(task) for task in table.tasks])
    axes.set_xlim(-0.5, len(table.tasks) - 0.5)
