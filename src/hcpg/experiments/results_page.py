"""What the stored runs of every experiment show so far, as one Markdown page beside the paper's numbers."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from hcpg.experiments.ledger import DONE, recorded
from hcpg.experiments.protocols import PROTOCOLS, Protocol
from hcpg.report import paper_tables, tables
from hcpg.report.comparison import Contrast, contrast, outcomes_of
from hcpg.report.published import PUBLISHED
from hcpg.report.records import Group, load_runs
from hcpg.report.statistics import last_five, spread, wilson

OURS = "hcpg_flow"
"""What every other preset on a task is compared with."""


def page(results: Path, protocols: Mapping[str, Protocol] = PROTOCOLS) -> str:
    """A section for each experiment that has stored runs under `results/NAME`."""
    stored = [name for name in protocols if (results / name).exists()]
    return "\n\n".join(section(name, protocols[name], results / name) for name in stored) + "\n"


def section(name: str, protocol: Protocol, folder: Path) -> str:
    """How far the experiment is and what its whole groups (those with every seed) show.

    A group that lacks a seed is counted and not shown: one table has the same seeds throughout.
    """
    found = recorded(protocol.cells(), folder)
    done = [entry for entry in found if entry.state in DONE]
    seeds, budget = " ".join(map(str, protocol.seeds)), protocol.settings()[0].budget
    groups = load_runs([entry.folder for entry in done if entry.folder]) if done else []
    groups = [group for group in groups if len(group.runs) == len(protocol.seeds)]
    head = (
        f"## {protocol.title}\n\n`hcpg experiment run {name}`: budget `{budget.name}`, {budget.steps:,} "
        f"steps, {budget.evaluations} evaluations of {budget.evaluation_episodes} episodes, seeds {seeds}. "
        f"{len(done)} of {len(found)} runs are done."
    )
    if not groups:
        return f"{head}\n\nNo method has all of its seeds on any task yet, so there is no table."
    blocks = [_block(name, part, len(done) == len(found)) for part in _alike(groups)]
    return "\n\n".join([head, *blocks, _beside_the_papers(groups), _costs(groups)])


def _alike(groups: Sequence[Group]) -> list[list[Group]]:
    """The groups in blocks of tasks that have the same presets: each block is a full table."""
    presets = {
        task: tuple(each.preset for each in groups if each.task == task)
        for task in sorted({group.task for group in groups})
    }
    return [
        [group for group in groups if presets[group.task] == shown]
        for shown in sorted(set(presets.values()), key=len, reverse=True)
    ]


def _block(name: str, groups: Sequence[Group], everything: bool) -> str:
    """One table as `hcpg report` prints it, each task in detail, and what the differences are."""
    command = ["hcpg", "report", f"results/{name}"]
    if not everything:
        command += ["--tasks", *dict.fromkeys(group.task for group in groups)]
        command += ["--presets", *dict.fromkeys(group.preset for group in groups)]
    table = paper_tables.markdown(paper_tables.main_table(groups)).rstrip()
    shown = f"```sh\n{shlex.join([*command, '--out', 'build/report'])}\n```\n\n{table}"
    return "\n\n".join(
        each for each in (shown, _differences(groups), tables.markdown(groups).rstrip()) if each
    )


def _differences(groups: Sequence[Group]) -> str:
    """HCPG-Flow against every other preset on the same task, by the last evaluation."""
    rows = [["task", "against", "HCPG-Flow", "the other", "difference, points", "what follows"]]
    for ours in groups:
        others = [each for each in groups if each.task == ours.task and each.preset != OURS]
        if ours.preset == OURS:
            rows += [_difference(contrast(outcomes_of(ours), outcomes_of(each))) for each in others]
    return paper_tables.aligned(rows) if len(rows) > 1 else ""


def _difference(found: Contrast) -> list[str]:
    low, high = found.decisive.interval
    return [
        found.first.protocol["task"],
        paper_tables.method_name(found.second.preset),
        *(_rate(each.total.successes, each.total.episodes) for each in (found.first, found.second)),
        f"{100 * found.decisive.estimate:+.1f} [{100 * low:+.1f}, {100 * high:+.1f}]",
        found.conclusion,
    ]


def _rate(successes: int, episodes: int) -> str:
    low, high = wilson(successes, episodes)
    return f"{100 * successes / episodes:.1f} [{100 * low:.1f}, {100 * high:.1f}]"


def _beside_the_papers(groups: Sequence[Group]) -> str:
    """Ours and the paper's last-five success; the budgets are not the same."""
    rows = [["task", "method", "ours", "the paper's"]]
    for group in groups:
        curve, theirs = group.curve(group.selector), PUBLISHED.get((group.task, group.preset))
        assert curve is not None  # every run of a stored group was evaluated
        rows.append(
            [
                group.task,
                paper_tables.method_name(group.preset),
                _spread(*spread(100 * last_five(curve.rates))),
                "not in it" if theirs is None else _spread(*theirs),
            ]
        )
    return "Beside the paper's, which trained for many times as many steps:\n\n" + paper_tables.aligned(rows)


def _spread(mean: float, deviation: float) -> str:
    return f"{mean:.1f} ± {deviation:.1f}"


def _costs(groups: Sequence[Group]) -> str:
    """The wall time of a run that was suspended is no cost."""
    runs = [run for group in groups for run in group.runs]
    hours = sum(run.undisturbed_s for run in runs) / 3600
    how = "steps and evaluations, each at the median of the time it took, one core a run"
    return f"These {len(runs)} runs cost about {hours:.1f} core-hours: {how}."
