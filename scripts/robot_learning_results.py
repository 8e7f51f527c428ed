"""Store clones and runs of `hcpg robot learn` as evidence: their rows, and a table made from the rows alone.

    python scripts/robot_learning_results.py --demos DEMOS... --runs RUNS --out docs/evidence/robot_learning

A clone has no rows of training; `hcpg evaluate RUN` gives every run rows of evaluation.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from hcpg.loops.cloning import FACTS as CLONING
from hcpg.loops.online import FACTS as LEARNING
from hcpg.loops.runs import RunFolder
from hcpg.report.records import find_runs
from hcpg.report.rows import read_rows

COLUMNS = (
    "task", "policy", "seed", "actions", "updates", "training episodes", "faults", "evaluation", "bare",
    "spread first, last", "actor's spread first, last", "weight entropy",
)  # fmt: skip
SEEN = ("selector_spread", "actor_spread", "selector_weight_entropy")


def main() -> None:
    """Write `results.json`, the rows and `table.md`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--demos", type=Path, nargs="+", required=True)
    parser.add_argument("--runs", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    results = [facts(RunFolder.open(path), asked.out) for path in find_runs(asked.runs)]
    shown = [demonstrated(path) for path in asked.demos]
    (asked.out / "results.json").write_text(json.dumps({"demos": shown, "runs": results}, indent=1) + "\n")
    lines = [COLUMNS, ("---",) * len(COLUMNS), *(row(each) for each in results)]
    (asked.out / "table.md").write_text("".join(f"| {' | '.join(line)} |\n" for line in lines))


def demonstrated(path: Path) -> dict[str, Any]:
    """What a folder of demonstrations is."""
    told = json.loads((path / "manifest.json").read_text())
    lengths = [each["actions"] for each in told["episodes"]]
    names = ("task", "robot", "kind", "source", "seed", "rewards", "sha256")
    counts = {"kept": len(lengths), "not_kept": len(told["not_kept"]), "actions": sum(lengths)}
    return {**{name: told[name] for name in names}, **counts, "mean_actions": float(np.mean(lengths))}


def facts(folder: RunFolder, out: Path) -> dict[str, Any]:
    """One run in numbers; its rows go under `out`."""
    run, status = folder.manifest()["run"], folder.status()
    is_clone = (folder.path / CLONING).is_file()
    name = f"{run['task'].partition('/')[2]}_{'clone' if is_clone else run['preset']}_s{run['seed']}"
    origin = json.loads((folder.path / (CLONING if is_clone else LEARNING)).read_text())
    metrics, episodes = folder.rows("metrics"), folder.rows("episodes")
    evaluations = [
        each for file in sorted(folder.path.glob("evaluations/*.jsonl")) for each in read_rows(file)
    ]
    rows = {"metrics": metrics, "episodes": episodes, "evaluation": evaluations}
    (out / f"{name}.json").write_text(json.dumps({"origin": origin, **rows}, separators=(",", ":")) + "\n")
    updates = metrics[-1]["updates"] if metrics else 0
    kinds = dict.fromkeys(each["selector"] for each in evaluations)
    policy = "clone" if is_clone else run["preset"]
    return {
        "task": run["task"], "policy": policy, "seed": run["seed"], "state": status["state"],
        "actions": status["step"], "updates": updates, "episodes": len(episodes),
        "successes": sum(each["success_once"] for each in episodes),
        "faults": sum(each["ended"] == "fault" for each in episodes),
        "evaluation": {kind: counted(evaluations, kind) for kind in kinds},
        **{name: ends(metrics, name) for name in SEEN},
    }  # fmt: skip


def counted(rows: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    """Successes, episodes and mean steps to success of one way of acting."""
    own = [each for each in rows if each["selector"] == kind]
    steps = [each["steps_to_success"] for each in own if each["success_once"]]
    return {"successes": len(steps), "episodes": len(own), "steps": float(np.mean(steps)) if steps else None}


def ends(metrics: list[dict[str, Any]], name: str) -> list[float]:
    """The first and the last number of a column; nothing where there is none."""
    found = [row[name] for row in metrics if row.get(name) is not None]
    return [found[0], found[-1]] if found else []


def row(run: dict[str, Any]) -> tuple[str, ...]:
    """The run's line of the table."""
    told = {name: _told(each) for name, each in run["evaluation"].items()}
    guided = next((text for name, text in told.items() if name != "bare"), "-")
    spreads = [
        ", ".join(f"{each:.2f}" for each in run[name]) or "-" for name in ("selector_spread", "actor_spread")
    ]
    entropy = ", ".join(f"{each:.2f}" for each in run["selector_weight_entropy"]) or "-"
    trained = f"{run['successes']}/{run['episodes']}" if run["episodes"] else "-"
    start = (run["task"], f"`{run['policy']}`", str(run["seed"]), str(run["actions"]), str(run["updates"]))
    return (*start, trained, str(run["faults"]), guided, told.get("bare", "-"), *spreads, entropy)


def _told(counts: dict[str, Any]) -> str:
    steps = "" if counts["steps"] is None else f", {counts['steps']:.1f} steps"
    return f"{counts['successes']}/{counts['episodes']}{steps}"


if __name__ == "__main__":
    main()
