"""`hcpg robot drill`: faults injected into a twin, and the table of what happened."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

from hcpg import registry
from hcpg.commands.arms import arm_action, with_priority
from hcpg.loops.control import drill_table
from hcpg.loops.control.drill import DrillError, Fault, Outcome, drill
from hcpg.loops.control.drill_list import FAULTS
from hcpg.loops.control.drill_processes import process_faults
from hcpg.loops.control.step_log import plain
from hcpg.registry import UnknownNameError
from hcpg.twin.keeping import KeptTwin


def add(actions: "argparse._SubParsersAction") -> None:
    """Declare the subcommand."""
    parser = arm_action(actions, "drill", carry_out, "inject faults into a twin and tell what happened")
    add_option = parser.add_argument
    add_option("--fault", nargs="*", help=f"some of: {', '.join(FAULTS)}; default: all")
    add_option("--serve", action="store_true", help="serve the twin at ADDRESS, and kill and freeze it, too")
    add_option("--out", type=Path, required=True, metavar="FOLDER", help="a new folder")
    add_option("--into", type=Path, metavar="FILE", help="a document with a place for the table")


def carry_out(options: argparse.Namespace) -> int:
    """0 where every fault was harmless."""
    with _served(options) as kept:
        faults = FAULTS if kept is None else {**FAULTS, **process_faults(kept)}
        names = options.fault or list(faults)
        for name in names:
            if name not in faults:
                raise UnknownNameError("fault", name, list(faults))
        outcomes: dict[str, Outcome] = {}
        for name in names:
            if kept is not None:
                kept.ensure()
            outcome = _drilled(options, name, faults)
            if outcome.signal is not None:
                return 128 + outcome.signal
            outcomes[name] = outcome
            sys.stdout.write(f"{drill_table.line(name, outcome)}\n")
            sys.stdout.flush()
    return _told(options, outcomes)


@contextmanager
def _served(options: argparse.Namespace) -> Iterator[KeptTwin | None]:
    """The twin that the drill serves, if it is to serve one."""
    if not options.serve:
        yield None
        return
    if options.address is None:
        raise DrillError("--serve needs the address to serve at: --address 127.0.0.1")
    from hcpg.robots.twin import START_SEED

    options.out.mkdir(parents=True, exist_ok=True)
    task = options.task.partition("/")[2]
    kept = KeptTwin(task, options.address, START_SEED, options.out / "server.log")
    with closing(kept):
        yield kept


def _drilled(options: argparse.Namespace, name: str, faults: Mapping[str, Fault]) -> Outcome:
    folder = options.out / name
    folder.mkdir(parents=True, exist_ok=False)
    plugin = registry.robot(options.robot)
    rig = with_priority(plugin.make(options.task, options.address))
    read_scene = registry.task(options.task).adapters["paper"]
    task = registry.robot_task(options.task)
    with closing(rig.stage):
        return drill(rig, plugin.kind, task, read_scene, faults[name], folder)


def _told(options: argparse.Namespace, outcomes: Mapping[str, Outcome]) -> int:
    (options.out / "outcomes.json").write_text(json.dumps(plain(outcomes), indent=2) + "\n")
    place = drill_table.place(options.robot, options.address, options.serve)
    table = drill_table.table(place, options.task, outcomes)
    (options.out / "table.md").write_text(table)
    if options.into is not None:
        options.into.write_text(drill_table.inserted(options.into.read_text(), place, table))
    return int(not all(map(drill_table.harmless, outcomes.values())))
