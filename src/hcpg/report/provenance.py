"""Where a table or picture comes from: the command and code that made it, and the runs that are in it."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from hcpg.report.checkout import commit_text, own_code
from hcpg.report.records import Group, Record

_UNKNOWN = "unknown"


class Provenance(NamedTuple):
    """What a picture carries with it."""

    command: str
    """That made the picture."""
    commit: str
    """Of the code that made it; a plus says that the checkout was altered."""
    facts: dict[str, str]
    """About the runs: tasks, presets, seeds, budget, steps, adapter, episodes, commits, commands."""

    def text(self) -> str:
        """Everything in one line."""
        facts = "; ".join(f"{name}: {value}" for name, value in self.facts.items())
        return f"made by: {self.command}; commit: {self.commit}; {facts}"


def provenance(groups: Sequence[Group], command: str) -> Provenance:
    """What the runs of `groups` were made from, and the code at hand; where runs differ, all is listed."""
    runs = [run for group in groups for run in group.runs]
    manifests = [_json(run, "manifest.json") for run in runs]
    budgets = [_json(run, "config.json")["budget"] for run in runs]
    steps = {curve.steps[-1] for run in runs for curve in run.curves.values() if curve.steps.size}
    episodes = {int(count) for run in runs for curve in run.curves.values() for count in curve.episodes}
    facts = {
        "presets": _listed(group.preset for group in groups),
        "tasks": _listed(group.task for group in groups),
        "seeds": " or ".join(_distinct(" ".join(str(run.seed) for run in group.runs) for group in groups)),
        "budget": _listed(budget["name"] for budget in budgets),
        "environment steps": " or ".join(f"{step:,}" for step in sorted(steps)),
        "adapter": _listed(run.adapter for run in runs),
        "episodes per evaluation": " or ".join(map(str, sorted(episodes))),
        "runs": str(len(runs)),
        "runs' commits": _listed(commit_text(manifest.get("code", {})) for manifest in manifests),
        "runs' commands": _listed(manifest.get("command", _UNKNOWN) for manifest in manifests),
    }
    return Provenance(command, commit_text(own_code()), facts)


def _json(run: Record, name: str) -> dict:
    return json.loads((Path(run.path) / name).read_text())


def _listed(names: Iterable[str]) -> str:
    return ", ".join(_distinct(names))


def _distinct(names: Iterable[str]) -> list[str]:
    return sorted(set(names))
