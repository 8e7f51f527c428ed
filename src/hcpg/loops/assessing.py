"""Evaluate a trained run anew: any checkpoint, any selector, on the evaluation's fixed start states."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.loops.evaluation import BARE, Evaluator
from hcpg.loops.streams import EVALUATION_SEED
from hcpg.loops.trained import Trained
from hcpg.report.rows import append_rows
from hcpg.report.statistics import wilson


class Assessment(NamedTuple):
    """What an evaluation found, and where its rows lie."""

    rows: list[dict[str, Any]]
    file: Path


def assess(trained: Trained, episodes: int, workers: int) -> Assessment:
    """One row per episode, with the selector and then bare, written into the run's `evaluations/`.

    The run's own tables stay as they are. The same call gives the same rows on a CPU.
    """
    settings = trained.settings
    settings = replace(settings, budget=replace(settings.budget, evaluation_episodes=episodes))
    evaluator = Evaluator(settings, trained.method, trained.read_scene, [trained.seed])
    names = dict.fromkeys((trained.name, BARE))
    rows = evaluator.evaluate(trained.states, trained.step, workers, names)[0]
    evaluator.close()
    selector = settings.evaluation_selector
    acting = BARE if trained.name == BARE else f"{selector.rule}-k{selector.candidates}"
    name = f"step_{trained.step:09d}_{acting}_{settings.adapter}_{episodes}.jsonl"
    return Assessment(rows, _written(trained.folder.path / "evaluations" / name, rows))


def summary(assessment: Assessment) -> str:
    """The rates in percent with 95 % Wilson intervals, for every selector, as plain lines."""
    names = dict.fromkeys(row["selector"] for row in assessment.rows)
    lines = [_line(name, [row for row in assessment.rows if row["selector"] == name]) for name in names]
    starts = [row["start"] for row in assessment.rows]
    head = f"{'':12}  {'success once':26}  {'at the end':26}  mean steps to success"
    where = f"start states {min(starts)} to {max(starts)} of the evaluation's set (seed {EVALUATION_SEED})"
    return "\n".join([head, *lines, f"{where}; rows in {assessment.file}"])


def _line(name: str, rows: list[dict[str, Any]]) -> str:
    once, at_end = (_rate([row[field] for row in rows]) for field in ("success_once", "success_at_end"))
    steps = [row["steps_to_success"] for row in rows if row["success_once"]]
    mean = f"{sum(steps) / len(steps):.1f} (of the {len(steps)} that succeeded)" if steps else "never"
    return f"{name:12}  {once:26}  {at_end:26}  {mean}"


def _rate(successes: list[bool]) -> str:
    count, episodes = sum(successes), len(successes)
    low, high = wilson(count, episodes)
    return f"{100 * count / episodes:.1f} [{100 * low:.1f}, {100 * high:.1f}] ({count}/{episodes})"


def _written(file: Path, rows: list[dict[str, Any]]) -> Path:
    file.parent.mkdir(exist_ok=True)
    beside = file.with_name(f".{file.name}.writing")
    beside.unlink(missing_ok=True)
    append_rows(beside, rows)
    return beside.rename(file)
