"""The tables of the ablation and of the candidate counts, as Markdown, LaTeX and CSV."""

import csv
import io
from collections.abc import Sequence

from hcpg.report import paper_tables
from hcpg.report.ablation import METRICS, Ablation, ablated, ablation, ablation_name, candidate_table
from hcpg.report.booktabs import booktabs
from hcpg.report.records import Group
from hcpg.report.tables import aligned


def files(groups: Sequence[Group]) -> dict[str, str]:
    """The ablation's tables by file name; none where `groups` hold no arm.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes or seeds.
        StatisticsError: a run has fewer than five evaluations.
    """
    chosen = ablated(groups)
    if not chosen:
        return {}
    found, counts = ablation(chosen), candidate_table(groups)
    texts = {"ablation.md": markdown(found), "ablation.tex": latex(found), "ablation.csv": as_csv(found)}
    if counts is not None:
        forms = {"md": paper_tables.markdown, "tex": paper_tables.latex, "csv": paper_tables.as_csv}
        texts |= {f"candidates.{kind}": form(counts) for kind, form in forms.items()}
    return texts


def markdown(found: Ablation) -> str:
    """As Markdown, with the protocol in a line below."""
    return f"{aligned([['Method', 'Runs', *METRICS], *_rows(found, '**{}**', '-')])}\n\n{_note(found)}\n"


def latex(found: Ablation) -> str:
    r"""As LaTeX with booktabs rules, the best of every column in bold; needs \usepackage{booktabs}."""
    return booktabs(["Method", "Runs", *METRICS], [_rows(found, r"\textbf{{{}}}", "--")], _note(found))


def as_csv(found: Ablation) -> str:
    """As CSV with a row per method and metric: mean over runs, sample SD over the seeds' means."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["method", "metric", "mean", "sd_over_seeds", "runs", "of", *found.protocol])
    for variant in found.variants:
        for metric, seeds in variant.seeds.items():
            deviation = f"{seeds.std(ddof=1):.4f}" if len(seeds) > 1 else ""
            numbers = [f"{seeds.mean():.4f}", deviation, variant.runs, found.runs]
            writer.writerow([ablation_name(variant.preset), metric, *numbers, *found.protocol.values()])
    return file.getvalue()


def _rows(found: Ablation, best: str, absent: str) -> list[list[str]]:
    """A row per method; the best printed mean of every metric is marked."""
    means = [
        {metric: round(float(seeds.mean()), 1) for metric, seeds in variant.seeds.items()}
        for variant in found.variants
    ]
    tops = {metric: max((each[metric] for each in means if each), default=None) for metric in METRICS}
    rows = []
    for variant, each in zip(found.variants, means, strict=True):
        texts = [
            absent if metric not in each else _marked(each[metric], tops[metric], best) for metric in METRICS
        ]
        rows.append([ablation_name(variant.preset), f"{variant.runs}/{found.runs}", *texts])
    return rows


def _marked(mean: float, top: float | None, best: str) -> str:
    return best.format(f"{mean:.1f}") if mean == top else f"{mean:.1f}"


def _note(found: Ablation) -> str:
    facts = ", ".join(f"{name} {value}" for name, value in found.protocol.items())
    tasks = ", ".join(found.tasks)
    return (
        f"Percent, means over the task-seed runs of {tasks}; a variant that lacks a task has none; {facts}."
    )
