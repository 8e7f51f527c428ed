"""The table of trials as Markdown, LaTeX and CSV; each says whether an arm moved or a twin."""

import csv
import io
import math
from collections.abc import Sequence

from hcpg.report.booktabs import booktabs
from hcpg.report.differences import Estimate
from hcpg.report.paper_tables import method_name, task_name
from hcpg.report.tables import aligned
from hcpg.report.trial_records import Study
from hcpg.report.trial_table import OVERALL, Cell, TrialTable

HEAD = ("Task", "Policy", "Success", "%", "95 % interval", "Steps", "Steps, failures at the cap")
CONTRAST_HEAD = ("Task", "Policies", "Difference, points", "95 % interval", "Fisher's p")
COLUMNS = (
    *("kind", "served", "task", "policy", "successes", "trials", "wilson_low", "wilson_high"),
    *("steps_of_successes", "steps_sd", "steps_failures_at_cap", "cap"),
)
CONTRAST_COLUMNS = (
    *("kind", "task", "first", "second", "difference", "newcombe_low", "newcombe_high", "fisher_p"),
)
_ABSENT = "-"


def label(table: TrialTable) -> str:
    """`twin` or `real`, with how it was reached."""
    if table.kind != "twin":
        return "real"
    return "twin, served over the arm's own protocol" if table.served else "twin, in the same process"


def caption(table: TrialTable) -> str:
    """What the numbers are."""
    arm = "no arm moved" if table.kind == "twin" else "an arm moved"
    caps = ", ".join(f"{task_name(task)} {cap}" for task, cap in table.horizons.items())
    overall = f" {OVERALL}: trials pooled, steps as means over tasks." if len(table.tasks) > 1 else ""
    return (
        f"Trials ({label(table)}; {arm}). Success is the first hit of the task's own detector, with Wilson's "
        "interval; steps are actions to it, mean and sample SD over successes, and beside them the mean with "
        f"every failure counted as the cap ({caps}). Differences have Newcombe's interval.{overall}"
    )


def markdown(table: TrialTable, studies: Sequence[Study]) -> str:
    """Caption, table, differences, disagreements and invalid trials."""
    rows = [list(HEAD), *_rows(table)]
    contrasts = [list(CONTRAST_HEAD), *_contrasts(table)]
    parts = [caption(table), aligned(rows)]
    parts += [aligned(contrasts)] if len(contrasts) > 1 else []
    return "\n\n".join([*parts, *_lists(studies), _plans(studies)]) + "\n"


def latex(table: TrialTable) -> str:
    """Two tabulars: the policies on the tasks, and their differences."""
    rows, blocks = _rows(table), []
    for task in dict.fromkeys(row[0] for row in rows):
        own = [row for row in rows if row[0] == task]
        blocks.append([own[0], *(["", *row[1:]] for row in own[1:])])
    first = booktabs(HEAD, blocks, caption(table))
    contrasts = _contrasts(table)
    return first + (booktabs(CONTRAST_HEAD, [contrasts], caption(table)) if contrasts else "")


def as_csv(table: TrialTable) -> str:
    """A row per task and policy, numbers unrounded; each says whether an arm moved or a twin."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for (task, policy), cell in table.cells.items():
        numbers = [*cell.tally, *cell.rate, cell.steps, cell.deviation, cell.capped]
        texts = ["" if math.isnan(number) else number for number in numbers]
        writer.writerow([table.kind, table.served, task, policy, *texts, table.horizons.get(task, "")])
    return out.getvalue()


def contrasts_csv(table: TrialTable) -> str:
    """A row per task and pair of policies."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(CONTRAST_COLUMNS)
    for each in table.contrasts:
        estimate = each.difference
        numbers = [estimate.estimate, *estimate.interval, each.p]
        writer.writerow([table.kind, each.task, each.first, each.second, *numbers])
    return out.getvalue()


def _rows(table: TrialTable) -> list[list[str]]:
    return [
        [_task(task), method_name(policy), *_texts(table.cells[task, policy], table.planned.get(task))]
        for task in [*table.tasks, OVERALL]
        for policy in table.policies
        if (task, policy) in table.cells
    ]


def _texts(cell: Cell, planned: int | None) -> list[str]:
    """The cell's numbers; where trials are missing, of how many is said."""
    missing = "" if planned in (None, cell.tally.episodes) else f" (of {planned} planned)"
    low, high = cell.rate
    spread = "" if math.isnan(cell.deviation) else f" ± {cell.deviation:.1f}"
    return [
        f"{cell.tally.successes}/{cell.tally.episodes}{missing}",
        f"{100 * cell.tally.rate:.1f}",
        f"{100 * low:.1f} to {100 * high:.1f}",
        _ABSENT if math.isnan(cell.steps) else f"{cell.steps:.1f}{spread}",
        f"{cell.capped:.1f}",
    ]


def _contrasts(table: TrialTable) -> list[list[str]]:
    rows = []
    for each in table.contrasts:
        pair = f"{method_name(each.first)} - {method_name(each.second)}"
        rows.append([_task(each.task), pair, *_estimate(each.difference), _p(each.p)])
    return rows


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def _estimate(found: Estimate) -> list[str]:
    low, high = found.interval
    return [f"{100 * found.estimate:+.1f}", f"{100 * low:+.1f} to {100 * high:+.1f}"]


def _task(task: str) -> str:
    return task if task == OVERALL else task_name(task)


def _lists(studies: Sequence[Study]) -> list[str]:
    """Where the labels disagree, and what does not count; both are said also where there is nothing."""
    attempts = [(task_name(study.plan["task"]), each) for study in studies for each in study.attempts]
    apart = [f"- {task}, trial {each.number} ({each.policy}, start {each.start}): {each.disagreement}"
             for task, each in attempts if each.disagreement and not each.invalid]  # fmt: skip
    invalid = [f"- {task}, trial {each.number}, attempt {each.attempt} ({each.policy}): {each.invalid}"
               for task, each in attempts if each.invalid]  # fmt: skip
    counted = sum(not each.invalid for _, each in attempts)
    heads = f"Labels that disagree: {len(apart)} of {counted} trials.", f"Invalid attempts: {len(invalid)}."
    return ["\n".join([head, *([""] if lines else []), *lines])
            for head, lines in zip(heads, (apart, invalid), strict=True)]  # fmt: skip


def _plans(studies: Sequence[Study]) -> str:
    hashes = ", ".join(f"{task_name(study.plan['task'])} {study.digest[:12]}" for study in studies)
    commits = sorted({each.facts.get("commit", "unknown") for study in studies for each in study.attempts})
    return f"Plans (SHA-256): {hashes}. Commits: {', '.join(commits)}."
