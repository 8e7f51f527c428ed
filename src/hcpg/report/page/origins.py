"""Where the numbers come from: what the methods' settings differ in, and what the runs' manifests say."""

import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hcpg.report.checkout import commit_text
from hcpg.report.dotted import dotted
from hcpg.report.records import Group, Record

NAMES = ("task", "preset")
"""Settings that only say which run it is."""
OF_EACH_RUN = ("run", "time", "command")
"""Parts of a manifest that differ from run to run by nature."""
MOST_VALUES = 4
"""Of a fact that differs between runs, so many values are listed."""


def settings(groups: Sequence[Group], presets: Sequence[str]) -> dict[str, Any]:
    """Settings by dotted key: `differing` with a value per preset, `alike` with the one value of all.

    A preset whose tasks differ in a setting has all its values, by `or`; one that lacks it has None.
    """
    values: dict[str, dict[str, set[str]]] = {}
    for group in groups:
        for key, value in dotted(group.runs[0].config).items():
            if key not in NAMES:
                values.setdefault(key, {}).setdefault(group.preset, set()).add(value)
    rows = {
        key: [" or ".join(sorted(of[preset])) if preset in of else None for preset in presets]
        for key, of in sorted(values.items())
    }
    return {
        "differing": [{"key": key, "values": row} for key, row in rows.items() if len(set(row)) > 1],
        "alike": {key: row[0] for key, row in rows.items() if len(set(row)) == 1},
    }


def manifest(groups: Sequence[Group], root: Path) -> dict[str, Any]:
    """Facts that all runs share, facts that differ with what they are, and a row per run.

    Args:
        groups: the runs.
        root: folder that the runs' places are told from.
    """
    runs = [run for group in groups for run in group.runs]
    # Thousands of runs have few different parts, and share their objects.
    counts = Counter((key, id(part)) for run in runs for key, part in run.manifest.items())
    parts = {id(part): part for run in runs for part in run.manifest.values()}
    seen: dict[str, Counter[str]] = {}
    for (name, part), count in counts.items():
        facts = {} if name in OF_EACH_RUN else dotted({name: parts[part]})
        for key, value in facts.items():
            seen.setdefault(key, Counter())[_plain(value)] += count
    alike = {key: next(iter(counts)) for key, counts in seen.items() if [*counts.values()] == [len(runs)]}
    differing = {key: _listed(counts, len(runs)) for key, counts in seen.items() if key not in alike}
    return {"alike": alike, "differing": differing, "runs": [_row(run, root) for run in runs]}


def _plain(value: str) -> str:
    """A text without its quotes; anything else as JSON has it."""
    read = json.loads(value)
    return read if isinstance(read, str) else value


def _listed(counts: Mapping[str, int], runs: int) -> list[str]:
    """Each value with how many runs have it; the rarest are summed up."""
    ordered = sorted(counts.items(), key=lambda each: (-each[1], each[0]))
    absent = runs - sum(counts.values())
    lines = [f"{value} ({_runs(count)})" for value, count in ordered[:MOST_VALUES]]
    if len(ordered) > MOST_VALUES:
        lines.append(f"{len(ordered) - MOST_VALUES} other values")
    return lines + ([f"absent ({_runs(absent)})"] if absent else [])


def _runs(count: int) -> str:
    return f"{count:,} run{'s' * (count != 1)}"


def _row(run: Record, root: Path) -> dict[str, Any]:
    folder = os.path.relpath(run.path, root)
    return {
        "task": run.task,
        "preset": run.preset,
        "seed": run.seed,
        "state": run.status.get("state"),
        "step": run.status.get("step"),
        "commit": commit_text(run.manifest.get("code", {})),
        "time": run.manifest.get("time"),
        "folder": run.path.name if folder.startswith(os.pardir) else folder,
    }
