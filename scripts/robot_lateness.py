"""Measures how late the 30 Hz loop wakes while it runs episodes on a served twin; writes the table of it.

    python scripts/robot_lateness.py measure --minutes 30 --about "..." --out docs/evidence/lateness/x.json
    python scripts/robot_lateness.py measure --minutes 3 --burn 0 1 --about "..." --out ...
    python scripts/robot_lateness.py table docs/evidence/lateness/*.json --into docs/robot_safety.md

The server is part of it and has cores of this machine, too (`make twin` first). A SIGINT ends it early, and
what was measured until then is written.
"""

import argparse
import itertools
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hcpg import registry
from hcpg.interfaces import Rig
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.deployed import Policy
from hcpg.loops.control.drill_table import inserted
from hcpg.loops.control.proposing import uniform
from hcpg.loops.control.records import EpisodeResult, StepRecord
from hcpg.loops.control.sessions import Session
from hcpg.robots.twin import START_SEED
from hcpg.safety.priority import raise_priority
from hcpg.selection import Selector
from hcpg.twin.launching import served

BUSY = "while True: pass"
EPISODE_S = 60.0
PLACE = "lateness"
ENDS = ("success", "time_limit")
HEAD = (
    "what else ran", "minutes of loop", "ticks", "lateness p50, ms", "p99, ms", "max, ms", "deadlines missed",
    "most in a row", "policy p99, ms", "held ticks", "reflexes", "other faults", "load average",
)  # fmt: skip


@contextmanager
def busy(cores: Sequence[int], idle_cores: Sequence[int]) -> Iterator[None]:
    """On each of these cores a process that never rests; on `idle_cores` it takes what is left over."""
    started = []
    for core, polite in [*((each, False) for each in cores), *((each, True) for each in idle_cores)]:
        process = subprocess.Popen([sys.executable, "-c", BUSY])
        os.sched_setaffinity(process.pid, {core})
        # This process has real-time priority, which a child would inherit: nothing else would run any more.
        kind = os.SCHED_IDLE if polite else os.SCHED_OTHER
        os.sched_setscheduler(process.pid, kind, os.sched_param(0))
        started.append(process)
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def chooser_of(task: str, policy: Path | None) -> Chooser:
    """The exported policy with its selector, or random proposals with HCPG."""
    adapters, size = registry.task(task).adapters, registry.robot_task(task).action_size
    if policy is None:
        return Chooser(partial(uniform, 0, size), Selector("hcpg"), adapters["paper"], size, 0)
    loaded = Policy.load(policy)
    return Chooser(loaded.proposer(0), loaded.selector, adapters[loaded.adapter], size, 0)


def episodes(rig: Rig, task: str, chooser: Chooser, seconds: float) -> tuple[EpisodeResult, ...]:
    """Episodes of a minute, one after the other, until the loop has run for so long."""
    horizon = int(EPISODE_S * rig.robot.limits.rate_hz)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "steps.jsonl"
        session = Session.of(rig, registry.robot_task(task), chooser, log, horizon)
        ticked = 0

        def starts() -> Iterator[int]:
            for start in itertools.count():
                if ticked >= seconds * rig.robot.limits.rate_hz:
                    return
                yield start

        done = []

        class Counted:
            """Sees every episode, as a learner would."""

            def alive(self) -> bool:
                return True

            def offer(self, result: EpisodeResult) -> None:
                nonlocal ticked
                ticked += result.timing.ticks + result.timing.skipped
                done.append(result)

        session.run(starts(), learner=Counted())
    return tuple(done)


def found(done: tuple[EpisodeResult, ...]) -> dict[str, Any]:
    """All ticks of all episodes in numbers."""
    records = [record for episode in done for record in episode.records]
    late_ms = 1000 * np.array([max(each.tick.woke_s - each.tick.due_s, 0.0) for each in records])
    policy_ms = 1000 * np.array([each.policy_s for each in records if np.isfinite(each.policy_s)])
    causes = [episode.verdict.cause for episode in done if episode.ended == "fault"]
    skipped = [each.tick.skipped for each in records]
    return {
        "episodes": len(done),
        "ticks": len(records),
        "minutes": (len(records) + sum(skipped)) / 30.0 / 60.0,
        "lateness_ms": shares(late_ms),
        "planned_lateness_max_ms": max(episode.timing.lateness_max_ms for episode in done),
        "policy_ms": shares(policy_ms),
        "skipped": sum(skipped),
        "longest_gap": max(skipped),
        "held": sum(episode.held for episode in done),
        "held_because": counted(records),
        "reflexes": sum("reflex" in cause for cause in causes),
        "other_faults": [cause for cause in causes if "reflex" not in cause],
    }


def shares(numbers: np.ndarray) -> dict[str, float]:
    """Percentiles, and the largest."""
    named = {f"p{share:g}": float(np.percentile(numbers, share)) for share in (50, 90, 99, 99.9)}
    return {**named, "max": float(numbers.max())}


def counted(records: Sequence[StepRecord]) -> dict[str, int]:
    """Ticks without a command, by cause; the numbers in a cause left out."""
    causes = [each.verdict.cause for each in records if each.executed is None]
    plain = ["".join(letter for letter in cause if not letter.isdigit()) for cause in causes]
    return {cause: plain.count(cause) for cause in dict.fromkeys(plain)}


def measure(options: argparse.Namespace) -> None:
    """Run the episodes and write the numbers."""
    task, load = f"franka/{options.task}", [os.getloadavg()[0]]
    with (
        tempfile.TemporaryDirectory() as folder,
        served(options.task, options.address, START_SEED, Path(folder) / "twin.log") as twin,
        busy(options.burn, options.burn_idle),
    ):
        sys.stderr.write(raise_priority())
        rig = registry.robot("twin").make(task, options.address)
        begun_s = time.perf_counter()
        done = episodes(rig, task, chooser_of(task, options.policy), 60.0 * options.minutes)
        took_s = time.perf_counter() - begun_s
        rig.stage.close()
        errors = sum(" ERROR " in line for line in twin.log.read_text().splitlines())
    load.append(os.getloadavg()[0])
    facts = {
        "command": shlex.join(["python", *sys.argv]),
        "about": options.about,
        "machine": f"{os.cpu_count()} cores, {platform.machine()}, Linux {platform.release()}",
        "cores_of_loop_and_server": sorted(os.sched_getaffinity(0)),
        "load_average_begin_end": load,
        "took_s": took_s,
        "server_errors": errors,
        **found(done),
    }
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(facts, indent=2) + "\n")
    sys.stdout.write(json.dumps(facts, indent=2) + "\n")


def row(facts: dict[str, Any]) -> tuple[str, ...]:
    """One measurement, as the table has it."""
    late = facts["lateness_ms"]
    # The tick that sees an episode's end has no command either.
    held = sum(count for cause, count in facts["held_because"].items() if cause not in ENDS)
    loads = " to ".join(f"{load:.1f}" for load in facts["load_average_begin_end"])
    return (
        facts["about"], f"{facts['minutes']:.1f}", f"{facts['ticks']:,}", f"{late['p50']:.3f}",
        f"{late['p99']:.3f}", f"{late['max']:.2f}", str(facts["skipped"]), str(facts["longest_gap"]),
        f"{facts['policy_ms']['p99']:.2f}", str(held), str(facts["reflexes"]),
        str(len(facts["other_faults"])), loads,
    )  # fmt: skip


def table(options: argparse.Namespace) -> None:
    """Print the table, or put it into its place in a document."""
    facts = [json.loads(file.read_text()) for file in options.files]
    rows = [HEAD, ("---",) * len(HEAD), *map(row, facts)]
    lines = [f"| {' | '.join(cells)} |" for cells in rows]
    commands = [f"    {each['command']}" for each in facts]
    text = "\n".join([*lines, "", "Commands:", "", *commands]) + "\n"
    if options.into is None:
        sys.stdout.write(text)
    else:
        options.into.write_text(inserted(options.into.read_text(), PLACE, text))


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    actions = parser.add_subparsers(required=True)
    one = actions.add_parser("measure")
    one.add_argument("--task", default="peg-insertion")
    one.add_argument("--address", default="127.0.0.9")
    one.add_argument("--minutes", type=float, required=True, help="of loop; resets are not counted")
    one.add_argument("--policy", type=Path, help="what `hcpg export` wrote; default: random proposals")
    one.add_argument("--burn", type=int, nargs="*", default=[], metavar="CORE", help="keep it busy")
    one.add_argument(
        "--burn-idle", type=int, nargs="*", default=[], metavar="CORE", help="with what it has left"
    )
    one.add_argument("--about", required=True, help="what else ran, for the table")
    one.add_argument("--out", type=Path, required=True)
    one.set_defaults(carry_out=measure)
    other = actions.add_parser("table")
    other.add_argument("files", type=Path, nargs="+")
    other.add_argument("--into", type=Path)
    other.set_defaults(carry_out=table)
    options = parser.parse_args()
    options.carry_out(options)


if __name__ == "__main__":
    main()
