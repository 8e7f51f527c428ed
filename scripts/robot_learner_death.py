"""Kills the learner's process of a real `hcpg robot learn` on a served twin, twice, and goes on each time.

    python scripts/robot_learner_death.py TASK --initial RUN --demos FOLDER --out FOLDER --into DOCUMENT

First it is killed (SIGKILL) in the middle of an episode, then in the middle of its updates; then the run is
left to its end. What became of the budget is told by the logs of the steps, as a table (`make twin` first).
"""

import argparse
import json
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil

from hcpg.loops import checkpoints
from hcpg.loops.control.drill_table import inserted
from hcpg.loops.online_learner import progress_of
from hcpg.loops.runs import RunFolder

PLACE = "learner"
INTO_EPISODE, LOOK_S, WITHIN_S = 20, 0.2, 300.0
"""Executed actions of an episode after which it is killed; how often that is looked for, and how long."""
HEAD = (
    "sitting", "the learner was killed", "it said", "exit code", "actions executed", "learned from",
    "updates", "outside the box, mm",
)  # fmt: skip


class Sitting(NamedTuple):
    """One call of the command."""

    code: int
    said: str
    """Its last line."""


def executed(run: Path) -> list[dict[str, Any]]:
    """Every tick of every log of the run at which something was executed."""
    lines = [line for log in sorted(run.glob("steps_*.jsonl")) for line in log.read_bytes().splitlines()]
    rows = [json.loads(line) for line in lines if line.startswith(b'{"kind":"step"') and line.endswith(b"}")]
    return [row for row in rows if row["executed"]]


def in_an_episode(run: Path, begun: int) -> bool:
    """Whether an episode past those `begun` before has made some of its actions."""
    rows = executed(run)
    newest = max((row["episode"] for row in rows), default=-1)
    return newest > begun and sum(row["episode"] == newest for row in rows) >= INTO_EPISODE


def in_its_updates(run: Path, begun: int) -> bool:
    """Whether an episode past those `begun` before is done that no checkpoint has yet."""
    logs = sorted(run.glob("steps_*.jsonl"))
    lines = [line for log in logs for line in log.read_bytes().splitlines()]
    ended = [json.loads(line)["episode"] for line in lines if line.startswith(b'{"kind":"episode"')]
    newest = max(ended, default=-1)
    return newest > begun and progress_of(RunFolder.open(run)).episodes <= newest


KILLS = {
    "in the middle of an episode": in_an_episode,
    "in the middle of its updates": in_its_updates,
    "-": None,
}
"""When, sitting by sitting; the last one is left alone."""


def sit(words: list[str], out: Path, when: Callable[[Path, int], bool] | None) -> Sitting:
    """Run the command; kill its learner once `when` says so, if it is given."""
    run = next((path.parent for path in out.rglob("learning.json")), None)
    begun = max((row["episode"] for row in executed(run)), default=-1) if run else -1
    with subprocess.Popen(
        [sys.executable, "-m", "hcpg", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        if when is not None:
            _kill(process, out, lambda path: when(path, begun))
        said, _ = process.communicate()
    sys.stdout.write(said)
    return Sitting(process.returncode, said.splitlines()[-1])


def _kill(process: "subprocess.Popen[str]", out: Path, when: Callable[[Path], bool]) -> None:
    until_s = time.monotonic() + WITHIN_S
    while process.poll() is None and time.monotonic() < until_s:
        run = next((path.parent for path in out.rglob("learning.json")), None)
        if run is not None and checkpoints.latest(run / "checkpoints") is not None and when(run):
            [learner] = [
                each
                for each in psutil.Process(process.pid).children()
                if "spawn_main" in " ".join(each.cmdline())
            ]
            learner.kill()
            return
        time.sleep(LOOK_S)
    raise RuntimeError("the run ended before its learner could be killed; give it more --steps")


def furthest_outside_mm(run: Path) -> float:
    """Of all measured positions at which something was executed, mm."""
    log = next(iter(sorted(run.glob("steps_*.jsonl")))).read_text().splitlines()
    limits = next(row["limits"] for row in map(json.loads, log) if row["kind"] == "connected")
    places = np.array([row["snapshot"]["position"] for row in executed(run)])
    outside = np.maximum(limits["box_low_m"] - places, places - limits["box_high_m"])
    return 1000 * max(float(outside.max()), 0.0)


def found(sitting: Sitting, killed: str, run: Path) -> tuple[str, ...]:
    """One row of the table: the budget, as the logs and the newest checkpoint have it after a sitting."""
    progress, said = progress_of(RunFolder.open(run)), sitting.said.replace(str(run), "RUN")
    numbers = (len(executed(run)), progress.executed, progress.updates)
    return (killed, said, str(sitting.code), *map(str, numbers), f"{furthest_outside_mm(run):.1f}")


def main() -> None:
    """Learn, and go on twice."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("task")
    parser.add_argument("--initial", type=Path, required=True)
    parser.add_argument("--demos", type=Path, required=True)
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--out", type=Path, required=True, help="a new folder")
    parser.add_argument("--into", type=Path, help="a document with a place for the table")
    chosen = parser.parse_args()
    learn = ["robot", "learn", chosen.task, "--robot", "twin", "--address", chosen.address, "--serve"]
    words = [*learn, "--initial", str(chosen.initial), "--demos", str(chosen.demos), "--out", str(chosen.out)]
    rows: list[tuple[str, ...]] = []
    for killed, when in KILLS.items():
        sitting = sit(words, chosen.out, when)
        run = next(chosen.out.rglob("learning.json")).parent
        rows.append(found(sitting, killed, run))
        words = [*learn, "--resume", str(run)]
    lines = [HEAD, ["---"] * len(HEAD), *((str(number), *row) for number, row in enumerate(rows, 1))]
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    text += f"\n    {shlex.join(['python', 'scripts/robot_learner_death.py', *sys.argv[1:]])}\n"
    sys.stdout.write(text)
    if chosen.into is not None:
        chosen.into.write_text(inserted(chosen.into.read_text(), PLACE, text))


if __name__ == "__main__":
    main()
