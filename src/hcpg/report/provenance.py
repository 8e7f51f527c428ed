"""Where a table or picture comes from: the command and code that made it, and the runs that are in it."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from hcpg.report.checkout import commit_text, own_code
from hcpg.report.records import Group

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


def signed(name: str, text: str, origin: Provenance) -> str:
    """A table with its provenance: in a line below Markdown or above LaTeX, in columns of CSV.

    CSV has no comments; so every row has presets, command and commit beside the protocol that it names.
    """
    if name.endswith(".csv"):
        return _with_columns(
            text, {"presets": origin.facts["presets"], "command": origin.command, "commit": origin.commit}
        )
    return f"{text}\n{origin.text()}\n" if name.endswith(".md") else f"% {origin.text()}\n{text}"


def _with_columns(text: str, constants: Mapping[str, str]) -> str:
    """The CSV with further columns, the same in all rows."""
    head, *rows = csv.reader(io.StringIO(text))
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([*head, *constants])
    writer.writerows([*row, *constants.values()] for row in rows)
    return file.getvalue()


def provenance(groups: Sequence[Group], command: str) -> Provenance:
    """What the runs of `groups` were made from, and the code at hand; where runs differ, all is listed."""
    runs = [run for group in groups for run in group.runs]
    manifests = [run.manifest for run in runs]
    steps = {curve.steps[-1] for run in runs for curve in run.curves.values() if curve.steps.size}
    episodes = {int(count) for run in runs for curve in run.curves.values() for count in curve.episodes}
    facts = {
        "presets": _listed(group.preset for group in groups),
        "tasks": _listed(group.task for group in groups),
        "seeds": " or ".join(_distinct(" ".join(str(run.seed) for run in group.runs) for group in groups)),
        "budget": _listed(run.config["budget"]["name"] for run in runs),
        "environment steps": " or ".join(f"{step:,}" for step in sorted(steps)),
        "adapter": _listed(run.adapter for run in runs),
        "episodes per evaluation": " or ".join(map(str, sorted(episodes))),
        "runs": str(len(runs)),
        "runs' commits": _listed(commit_text(manifest.get("code", {})) for manifest in manifests),
        "runs' commands": _listed(manifest.get("command", _UNKNOWN) for manifest in manifests),
    }
    return Provenance(command, commit_text(own_code()), facts)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(_distinct(names))


def _distinct(names: Iterable[str]) -> list[str]:
    return sorted(set(names))
