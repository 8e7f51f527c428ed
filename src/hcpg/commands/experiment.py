"""`hcpg experiment`: make the runs of a table, on one machine or a cluster, or see how far they are."""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from hcpg.commands import report
from hcpg.commands.options import check
from hcpg.experiments import engine, ledger
from hcpg.experiments.adoption import adopt
from hcpg.experiments.forecast import hours_left
from hcpg.experiments.protocols import PROTOCOLS, Protocol, protocol

DESCRIPTION = """Run the missing runs of an experiment, one a core (on a GPU: the seeds of a preset together),
or show which are done. A finished run is not repeated, a stopped or lost one is resumed, and launches at once
share the work. Runs lie in OUT/NAME, the report of a complete experiment in OUT/NAME/report."""
BY_SIGNAL = 128


def run(arguments: Sequence[str]) -> int:
    """Carry out `run`, `status` or `list`; gives the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.action == "list":
        return _list()
    if options.name is None:
        parser.error(f"name an experiment: {', '.join(PROTOCOLS)}")
    cores = sorted(os.sched_getaffinity(0))
    if options.cores is not None and not 1 <= options.cores <= len(cores):
        parser.error(f"--cores {options.cores}: this process may use 1 to {len(cores)}")
    if options.gpus_per_job is not None and not 0 <= options.gpus_per_job <= 1:
        parser.error(f"--gpus-per-job {options.gpus_per_job}: a share of one card, from 0 (none) to 1")
    if options.cores_per_job < 1:
        parser.error(f"--cores-per-job {options.cores_per_job}: a job needs at least one")
    options.cores = cores[: options.cores]
    whole = protocol(options.name)
    if options.seeds:
        whole = replace(whole, seeds=tuple(dict.fromkeys(options.seeds)))
    part = whole.only(options.tasks, options.presets)
    if options.action == "status":
        return _status(ledger.entries(part.cells(), options.out / options.name), len(options.cores))
    return _run(options, part, whole)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="hcpg experiment", description=DESCRIPTION)
    add = parser.add_argument
    add("action", choices=("run", "status", "list"))
    add("name", nargs="?", metavar="NAME", help="`hcpg experiment list` shows all")
    add("--out", type=Path, default=Path("results"), help="default: results")
    add("--seeds", type=int, nargs="+", help="others than the experiment's own, to settle what is undecided")
    add("--tasks", nargs="+", default=[], metavar="TASK", help="only these of the experiment's")
    add("--presets", nargs="+", default=[], metavar="PRESET", help="only these of the experiment's")
    add("--cores", type=int, help="cores of this machine to use, one run on each; default: all")
    add(
        "--gpus-per-job",
        type=float,
        metavar="SHARE",
        help="0.5: two jobs on a card, 0: train on cores; default: 1 where this machine has a GPU, else 0",
    )
    add("--ray", metavar="ADDRESS", help="run on this Ray cluster (docs/cluster.md), e.g. auto or HOST:6379")
    add("--cores-per-job", type=int, default=1, help="with --ray: cores that a job gets; default: 1")
    add("--no-report", action="store_true", help="do not write the report when all runs are done")
    return parser


def _run(options: argparse.Namespace, part: Protocol, whole: Protocol) -> int:
    for settings in part.settings():
        check(settings)
    cells, results = part.cells(), options.out / options.name
    taken = adopt(cells, results, [options.out / name for name in PROTOCOLS if name != options.name])
    if taken:
        _say(f"{len(taken)} runs are taken over from other experiments in {options.out}")
    with closing(_place(options)) as place:
        ended = engine.run(cells, results, place, _say)
    if ended.signal is not None:
        return BY_SIGNAL + ended.signal
    _status(ledger.entries(cells, results), len(options.cores))
    if ended.failed:
        return 1
    everything = ledger.entries(whole.cells(), results)
    if options.no_report or any(entry.state not in ledger.DONE for entry in everything):
        return 0
    return report.run([str(results)])


def _place(options: argparse.Namespace) -> engine.Place:
    """What the jobs run on."""
    from hcpg.experiments import local, slots
    from hcpg.loops import machine

    share = options.gpus_per_job
    if options.ray is not None:
        from hcpg.experiments.cluster import RayCluster
        from hcpg.experiments.station import Needs

        return RayCluster(options.ray, Needs(options.cores_per_job, share or 0.0))
    if share is None:
        share = 1.0 if machine.has_accelerator() else 0.0
    if share == 0.0:
        return local.ThisMachine(slots.core_slots(options.cores), together=False)
    return local.ThisMachine(slots.card_slots(slots.cards(), share, options.cores), together=True)


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _list() -> int:
    width = max(map(len, PROTOCOLS))
    for name, each in PROTOCOLS.items():
        sys.stdout.write(f"{name:{width}}  {each.title}: {len(each.cells())} runs, budget {each.budget}\n")
    return 0


def _status(entries: list[ledger.Entry], slots: int) -> int:
    """A line per task and preset, with the state of each seed; then the sum."""
    lines: dict[str, list[str]] = {}
    for entry in entries:
        chosen = entry.cell.settings
        lines.setdefault(f"{chosen.task} {chosen.preset}", []).append(f"s{entry.cell.seed} {_words(entry)}")
    width = max(map(len, lines))
    for name, states in lines.items():
        _say(f"{name:{width}}  {', '.join(states)}")
    counts = Counter(entry.state for entry in entries)
    _say(", ".join(f"{count} {state}" for state, count in counts.items()) + _time_left(entries, slots))
    return 0


def _words(entry: ledger.Entry) -> str:
    """The entry's state, and how far it is if it is between beginning and end."""
    if entry.state not in ("running", "stopped", "failed") or entry.step == 0:
        return entry.state
    return f"{entry.state} at {100 * entry.step // entry.cell.settings.budget.steps} %"


def _time_left(entries: list[ledger.Entry], cores: int) -> str:
    """What to expect of the runs that are left, with as many at a time as there are now."""
    if all(entry.state in ledger.DONE for entry in entries):
        return ""
    running = sum(entry.state == "running" for entry in entries)
    hours = hours_left(entries, running or cores)
    if hours is None:
        return ", time left unknown before a run has learned for a while"
    time = f"{hours:.1f} hours" if hours >= 1 else f"{60 * hours:.0f} minutes"
    return f", about {time} left, {running or cores} at a time"
