"""Everything the page shows, gathered as one JSON value."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import hcpg
from hcpg.report.bars import ordered
from hcpg.report.page.contrasts import across_tasks, contrasts
from hcpg.report.page.looks import looks
from hcpg.report.page.media import Embedding, pictures, videos
from hcpg.report.page.origins import manifest, settings
from hcpg.report.page.results import results, task_means
from hcpg.report.paper_tables import method_name, task_names
from hcpg.report.protocol import one_protocol
from hcpg.report.records import BARE, Group

OURS = "hcpg_flow"
"""What the others are compared with, where it is there and nothing else is asked for."""


class Request(NamedTuple):
    """What was asked for, and what came with it."""

    roots: Sequence[Path]
    """Where the runs were looked for."""
    out: Path
    """The page's file; links are relative to it."""
    command: str
    """That made the page."""
    commit: str
    """Of the code that made it."""
    reference: str | None = None
    """The preset that the others are compared with."""
    figures: Sequence[Path] = ()
    """Figure files to show."""
    notices: Sequence[str] = ()
    """What was said while the runs were read: files left out, lines dropped."""


def content(groups: Sequence[Group], request: Request) -> dict[str, Any]:
    """The page's data; all groups must have one protocol.

    Raises:
        RecordError: the groups differ in budget, steps, adapter, evaluation episodes, seeds or start states.
        StatisticsError: a group has fewer than five evaluations.
        StyleError: more presets than can be told apart.
    """
    protocol = one_protocol(groups)
    presets = ordered([group.preset for group in groups])
    groups = sorted(groups, key=lambda group: (group.task, presets.index(group.preset)))
    reference = request.reference or (OURS if OURS in presets else presets[0])
    found, embedding = results(groups), Embedding(request.out.parent)
    return {
        "title": _title(groups, presets),
        "made": {"command": request.command, "commit": request.commit, "version": hcpg.__version__},
        "protocol": protocol,
        "notices": list(request.notices),
        "presets": _presets(groups, presets),
        "tasks": _tasks(groups),
        "reference": reference,
        "results": found,
        "task_means": task_means(found, presets),
        "across": across_tasks(groups, presets, reference),
        "contrasts": contrasts(groups, reference),
        "settings": settings(groups, presets),
        "videos": videos(groups, embedding),
        "pictures": pictures(request.figures, embedding),
        "manifest": manifest(groups, request.roots[0]),
    }


def _title(groups: Sequence[Group], presets: Sequence[str]) -> str:
    tasks = {group.task for group in groups}
    methods = method_name(presets[0]) if len(presets) == 1 else f"{len(presets)} methods"
    return f"{methods} on {next(iter(tasks)) if len(tasks) == 1 else f'{len(tasks)} tasks'}"


def _presets(groups: Sequence[Group], presets: Sequence[str]) -> list[dict[str, Any]]:
    selectors = {group.preset: group.selector for group in groups}
    seen = looks(presets)
    return [
        {
            "preset": preset,
            "name": method_name(preset),
            "selector": None if selectors[preset] == BARE else selectors[preset],
            **seen[preset],
        }
        for preset in presets
    ]


def _tasks(groups: Sequence[Group]) -> list[dict[str, str]]:
    names = task_names([group.task for group in groups])
    return [{"task": task, "name": names[task], "suite": task.partition("/")[0]} for task in sorted(names)]
