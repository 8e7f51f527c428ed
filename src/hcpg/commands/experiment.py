"""`hcpg experiment`: make the runs of a table, or see how far they are."""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from hcpg.experiments import engine, ledger
from hcpg.experiments.protocols import PROTOCOLS, protocol

DESCRIPTION = """Run the missing runs of an experiment, one a core, or show which are done. A finished run is
not repeated, a stopped one is resumed, and launches at once share the work. Runs lie in OUT/NAME."""
BY_SIGNAL = 128


def run(arguments: Sequence[str]) -> int:
    """Carry out `run`, `status` or `list`; gives the exit code."""
    parser = argparse.ArgumentParser(prog="hcpg experiment", description=DESCRIPTION)
    parser.add_argument("action", choices=("run", "status", "list"))
    parser.add_argument("name", nargs="?", metavar="NAME", help="`hcpg experiment list` shows all")
    parser.add_argument("--out", type=Path, default=Path("results"), help="default: results")
    parser.add_argument("--cores", type=int, help="runs at a time; default: as many as there are cores")
    options = parser.parse_args(arguments)
    if options.action == "list":
        return _list()
    if options.name is None:
        parser.error(f"name an experiment: {', '.join(PROTOCOLS)}")
    cores = sorted(os.sched_getaffinity(0))
    if options.cores is not None and not 1 <= options.cores <= len(cores):
        parser.error(f"--cores {options.cores}: this process may use 1 to {len(cores)}")
    cores = cores[: options.cores]
    cells, results = protocol(options.name).cells(), options.out / options.name
    if options.action == "status":
        return _status(ledger.entries(cells, results), len(cores))
    ended = engine.run(cells, results, cores, _say)
    if ended.signal is not None:
        return BY_SIGNAL + ended.signal
    return 1 if ended.failed else _status(ledger.entries(cells, results), len(cores))


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
        lines.setdefault(f"{chosen.task} {chosen.preset}", []).append(f"s{entry.cell.seed} {entry.state}")
    width = max(map(len, lines))
    for name, states in lines.items():
        sys.stdout.write(f"{name:{width}}  {', '.join(states)}\n")
    counts = Counter(entry.state for entry in entries)
    hours = ledger.hours_left(entries, slots)
    left = "" if counts.keys() <= set(ledger.DONE) else ", time left unknown before a run has finished"
    if left and hours is not None:
        left = f", about {hours:.1f} hours left on {slots} cores"
    sys.stdout.write(", ".join(f"{count} {state}" for state, count in counts.items()) + left + "\n")
    return 0
