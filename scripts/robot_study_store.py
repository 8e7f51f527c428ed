"""Keep what `scripts/robot_study.sh` made, without what is large, and tabulate how each run learned.

python scripts/robot_study_store.py STUDY FOLDER
"""

import argparse
import gzip
import json
import shutil
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

LEARNED = ("config.json", "metrics.jsonl", "episodes.jsonl", "status.json")
HEAD = (
    "Task", "Run", "Actions", "Updates", "Learner, s", "Episodes", "Succeeded",
    "Actor's spread, first", "last", "Selector's spread", "Weight entropy",
)  # fmt: skip
TIMED = (
    "Task", "Attempts", "Invalid", "Faults of the arm", "Seconds from one to the next, median", "Ticks",
    "Deadlines missed", "Lateness p50, ms", "p99, ms", "max, ms",
)  # fmt: skip
"""Lateness p50 and p99 are medians over the attempts."""


def store(study: Path, folder: Path) -> None:
    """Copy manifests, facts, rows and ledgers, and the log of one trial per task."""
    for manifest in study.glob("demos/*/manifest.json"):
        _copy(manifest, folder / "demos" / f"{manifest.parent.name}.json")
    for facts in study.glob("clone/*/**/cloning.json"):
        _copy(facts, folder / "clones" / f"{_task(facts)}.json")
    for metrics in study.glob("learn/*/**/metrics.jsonl"):
        to = folder / "learning" / _task(metrics) / _preset(metrics)
        for name in LEARNED:
            _copy(metrics.with_name(name), to / name)
        _copy_beginning(metrics.with_name("learning.json"), to)
    for plan in study.glob("trials/franka/*/plan.json"):
        to = folder / "trials/franka" / plan.parent.name
        for name in ("plan.json", "ledger.jsonl"):
            _copy(plan.with_name(name), to / name)
        if (shown := _shown(plan.parent)) is not None:
            _copy(shown / "trial.json", to / shown.name / "trial.json")
            packed = gzip.compress((shown / "steps.jsonl").read_bytes(), mtime=0)
            (to / shown.name / "steps.jsonl.gz").write_bytes(packed)


def _shown(trials: Path) -> Path | None:
    """The first trial of HCPG-Flow that succeeded and counts, else the first of any policy."""
    rows = [json.loads(line) for line in (trials / "ledger.jsonl").read_text().splitlines()]
    begun = {row["trial"]: row for row in rows if row["row"] == "begun" and row["attempt"] == 1}
    counted = [row for row in rows if row["row"] == "ended" and row["attempt"] == 1 and not row["invalid"]]
    done = [row["trial"] for row in counted if row["ended"] == "success"]
    if not done:
        return None
    chosen = begun[min(done, key=lambda number: (begun[number]["policy"] != "hcpg_flow", number))]
    return trials / f"trial_{chosen['trial']:03d}_{chosen['code']}"


def table(folder: Path) -> str:
    """How each stored run learned, in Markdown."""
    rows = [HEAD, tuple("---" for _ in HEAD)]
    for path in sorted((folder / "learning").glob("*/*/metrics.jsonl")):
        metrics = [json.loads(line) for line in path.read_text().splitlines()]
        episodes = [json.loads(line) for line in path.with_name("episodes.jsonl").read_text().splitlines()]
        last = metrics[-1]
        rows.append((
            path.parts[-3], path.parts[-2], str(last["step"]), str(last["updates"]), f"{last['wall_s']:.0f}",
            str(len(episodes)), str(sum(each["success_once"] for each in episodes)),
            f"{metrics[0]['actor_spread']:.2f}", f"{last['actor_spread']:.2f}",
            _mean(metrics, "selector_spread"), _mean(metrics, "selector_weight_entropy"),
        ))  # fmt: skip
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def timing(folder: Path) -> str:
    """What the stored trials took, and how late the loop was in them, in Markdown."""
    rows = [TIMED, tuple("---" for _ in TIMED)]
    for path in sorted((folder / "trials").glob("franka/*/ledger.jsonl")):
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        begun = [datetime.fromisoformat(line["time"]) for line in lines if line["row"] == "begun"]
        ended = [line for line in lines if line["row"] == "ended"]
        gaps_s = [(after - before).total_seconds() for before, after in pairwise(begun)]
        timings = [line["timing"] for line in ended if "timing" in line]
        rows.append((
            path.parts[-2], str(len(ended)), str(sum(bool(line["invalid"]) for line in ended)),
            str(sum(line["ended"] == "fault" for line in ended)), f"{np.median(gaps_s):.0f}",
            str(sum(each["ticks"] for each in timings)), str(sum(each["skipped"] for each in timings)),
            f"{np.median([each['lateness_p50_ms'] for each in timings]):.2f}",
            f"{np.median([each['lateness_p99_ms'] for each in timings]):.2f}",
            f"{max(each['lateness_max_ms'] for each in timings):.1f}",
        ))  # fmt: skip
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _mean(metrics: list[dict[str, Any]], name: str) -> str:
    """Over the episodes; of a method that proposes once there is nothing to tell."""
    found = [row[name] for row in metrics if row.get(name)]
    return f"{np.mean(found):.2f}" if found else "-"


def _task(path: Path) -> str:
    """The part of `.../franka/TASK/PRESET/s0/ID/file` after the slash of the task's name."""
    return path.parts[-5]


def _preset(path: Path) -> str:
    return path.parts[-4]


def _copy_beginning(path: Path, to: Path) -> None:
    """Where a run began; its clone and demonstrations are named within the study, wherever that lay."""
    facts = json.loads(path.read_text())
    for name, kind in (("initial", "clone"), ("demonstrations", "demos")):
        parts = Path(facts[name]["path"]).parts
        facts[name]["path"] = str(Path("study", *parts[parts.index(kind) :]))
    (to / path.name).write_text(json.dumps(facts, indent=2) + "\n")


def _copy(path: Path, to: Path) -> None:
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(path, to)


def main() -> None:
    """Store the study and write `learning.md` and `timing.md`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", type=Path)
    parser.add_argument("folder", type=Path)
    chosen = parser.parse_args()
    store(chosen.study, chosen.folder)
    for name, text in (("learning.md", table(chosen.folder)), ("timing.md", timing(chosen.folder))):
        (chosen.folder / name).write_text(text)
        print(text)


if __name__ == "__main__":
    main()
