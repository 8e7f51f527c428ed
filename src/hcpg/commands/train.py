"""`hcpg train`: start or continue runs, and watch them."""

import argparse
import difflib
import signal
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from hcpg import presets
from hcpg.commands import options as single
from hcpg.loops import machine, population
from hcpg.loops.child import Job
from hcpg.loops.display import Progress, view
from hcpg.loops.population import Ended, lane_of
from hcpg.loops.runs import RunFolder
from hcpg.loops.sitting import EXTENDABLE, extended, seed_of
from hcpg.loops.tracking import TrackedView
from hcpg.presets import Settings
from hcpg.report.extras import require
from hcpg.report.trackers import PACKAGES, TRACKERS

DESCRIPTION = """Train runs (one per preset and seed), or continue runs with --resume. On a CPU every run is a
process on one core; on a GPU all seeds of a preset are trained together."""
EPILOG = """Every single value can be set too, e.g. --learner.target-entropy 4 --budget.steps 20000
--selector.candidates 8; see below. --selector.* acts while training data is collected,
--evaluation-selector.* at evaluation."""
DEFAULT_PRESET, DEFAULT_BUDGET = "hcpg_flow", "cpu"
FAILED, DIVERGED, BY_SIGNAL = 1, 3, 128


def run(arguments: Sequence[str]) -> int:
    """Train until every run has ended; gives the exit code."""
    parser = _parser()
    names, rest = parser.parse_known_args(arguments)
    if {"-h", "--help"} & set(rest):
        return _help(parser)
    _refuse_typos(parser, rest)
    if names.resume is None and names.task is None:
        parser.error("give --task for new runs, or --resume RUN to continue some")
    jobs = _resumed(names, rest) if names.resume else _new(names, rest)
    lanes = {
        lane_of(job.config, seed): job.config["budget"]["warmup_steps"] for job in jobs for seed in job.seeds
    }
    if len(lanes) < sum(len(job.seeds) for job in jobs):
        parser.error("a run of one task, preset and seed is named twice; train such runs one after another")
    progress = {lane: Progress(lane, warmup) for lane, warmup in lanes.items()}
    console = Console()
    for name in names.tracker:
        require(PACKAGES[name], "trackers")
    with view(console, progress, _heading(jobs)) as shown:
        tracked = TrackedView(shown, lanes, names.tracker)
        ended = population.train(jobs, tracked, machine.has_accelerator())
    _report(console, ended)
    trouble = tracked.finish()
    if trouble:
        console.print(trouble, soft_wrap=True, markup=False, highlight=False)
    return exit_code(ended)


def exit_code(ended: Ended) -> int:
    """What `hcpg --help` says the number means."""
    states = {outcome.state for outcome in ended.outcomes}
    if ended.signal is not None:
        return BY_SIGNAL + ended.signal
    if "failed" in states:
        return FAILED
    if "stopped" in states:  # somebody sent SIGTERM to a run's own process
        return BY_SIGNAL + signal.SIGTERM
    return DIVERGED if "diverged" in states else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hcpg train", description=DESCRIPTION, epilog=EPILOG, add_help=False, allow_abbrev=False
    )
    add = parser.add_argument
    add("--task", help="suite/name, e.g. metaworld/drawer-open; `hcpg list tasks` shows all")
    add("--preset", nargs="+", help=f"several are trained side by side; default: {DEFAULT_PRESET}")
    add("--budget", help=f"`hcpg list budgets` shows all; default: {DEFAULT_BUDGET}")
    add("--adapter", help="how the task's scene is read: paper (default) or contact")
    add("--seeds", type=int, nargs="+", default=[0], help="one run each; default: 0")
    add("--steps", type=int, help="environment steps per run; with --resume, extends a finished run")
    add(
        "--tracker",
        nargs="+",
        choices=list(TRACKERS),
        default=[],
        help="mirror the rows there while training",
    )
    add("--out", type=Path, default=Path("runs"), help="where new run folders go; default: runs")
    add(
        "--resume", type=Path, nargs="+", metavar="RUN", help="run folders to continue from their checkpoints"
    )
    return parser


def _help(parser: argparse.ArgumentParser) -> int:
    settings = presets.settings("", DEFAULT_PRESET, DEFAULT_BUDGET)
    heading = f"single values, with the defaults of preset {DEFAULT_PRESET} and budget {DEFAULT_BUDGET}:"
    sys.stdout.write(f"{parser.format_help()}\n{heading}\n\n{single.help_text(settings)}")
    return 0


def _refuse_typos(parser: argparse.ArgumentParser, rest: Sequence[str]) -> None:
    """Options without a dot are this parser's; those with one belong to the settings."""
    known = [option for action in parser._actions for option in action.option_strings]
    for option in rest:
        if option.startswith("--") and "." not in option:
            near = difflib.get_close_matches(option, known, n=1)
            guess = f" Did you mean {near[0]}?" if near else ""
            parser.error(f"there is no option {option}.{guess} Known: {', '.join(known)}, and --PART.NAME.")


def _named(names: argparse.Namespace, settings: Settings) -> Settings:
    """`settings` with the values that have an option of their own."""
    changed = {"adapter": names.adapter or settings.adapter}
    if names.steps is not None:
        changed["budget"] = replace(settings.budget, steps=names.steps)
    return replace(settings, **changed)


def _asked(names: argparse.Namespace, settings: Settings) -> Settings:
    """A run's settings with whatever else was asked for, so that a contradiction shows."""
    changed = {"task": names.task, "preset": names.preset and names.preset[0], "adapter": names.adapter}
    if names.budget is not None:
        changed["budget"] = replace(settings.budget, name=names.budget)
    return replace(settings, **{name: value for name, value in changed.items() if value is not None})


def _new(names: argparse.Namespace, rest: Sequence[str]) -> list[Job]:
    jobs = []
    for preset in names.preset or [DEFAULT_PRESET]:
        settings = presets.settings(names.task, preset, names.budget or DEFAULT_BUDGET)
        settings = single.overridden(_named(names, settings), rest)
        single.check(settings)
        jobs.append(Job(settings.as_json(), names.seeds, names.out, []))
    return jobs


def _resumed(names: argparse.Namespace, rest: Sequence[str]) -> list[Job]:
    """The runs as they were, grouped by configuration; only their length may change.

    Raises:
        RunFolderError: another value was asked for.
    """
    jobs: list[Job] = []
    for path in names.resume:
        folder = RunFolder.open(path)
        settings = single.overridden(_asked(names, extended(folder, names.steps)), rest)
        folder.check_config(settings.as_json(), EXTENDABLE)
        single.check(settings)
        config, seed = settings.as_json(), seed_of(folder)
        same = next((job for job in jobs if job.config == config and seed not in job.seeds), None)
        if same is None:
            jobs.append(Job(config, [seed], folder.path.parent, [folder.path]))
        else:
            same.seeds.append(seed)
            same.folders.append(folder.path)
    return jobs


def _heading(jobs: list[Job]) -> str:
    tasks = dict.fromkeys(job.config["task"] for job in jobs)
    budgets = dict.fromkeys(
        f"budget {job.config['budget']['name']}, {job.config['budget']['steps']:,} steps per run"
        for job in jobs
    )
    return f"{', '.join(tasks)}: {', '.join(budgets)}"


def _report(console: Console, ended: Ended) -> None:
    """Where everything lies, and how to go on."""
    lines = [
        f"{outcome.lane.preset} s{outcome.lane.seed}  {outcome.state:9} {outcome.folder}"
        for outcome in ended.outcomes
        if outcome.folder is not None
    ]
    open_ends = [str(outcome.folder) for outcome in ended.outcomes if outcome.state in ("stopped", "failed")]
    if open_ends:
        lines.append(f"go on with: hcpg train --resume {' '.join(open_ends)}")
    for line in lines:
        console.print(line, soft_wrap=True, markup=False, highlight=False)
