"""Lets the scripted experts do the four tasks on a twin, through the control loop; prints what came of it.

    python scripts/twin_experts.py                  on the fast twin
    python scripts/twin_experts.py --served         on served twins, started for it (`make twin` first)

The experts see the truth, so the numbers say that scenes, driver and loop work, and nothing of a policy.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from hcpg import registry
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Session
from hcpg.robots.twin import START_SEED
from hcpg.safety.priority import raise_priority
from hcpg.selection import Selector
from hcpg.tasks.franka import below_tcp
from hcpg.tasks.franka.button_press import FINGERTIP_M
from hcpg.tasks.franka.peg_insertion import PEG_TIP_M
from hcpg.twin.experts import Moment, act
from hcpg.twin.launching import served
from hcpg.twin.scenes import SCENES

ADDRESS = "127.0.0.7"
ALONE = Selector(rule="first", candidates=1)


def session(task: str, address: str | None, speed: float, log: Path) -> Session:
    """A session in which the expert proposes, by the truth that the twin's stage knows."""
    name = f"franka/{task}"
    rig: Any = registry.robot("twin").make(name, address)
    tip_m = PEG_TIP_M if task == "peg-insertion" else FINGERTIP_M
    facts, robot_task = registry.task(name), registry.robot_task(name)

    def propose(observation: np.ndarray, count: int, draw: int) -> np.ndarray:
        truth = rig.stage.truth()
        tool, width_m = np.asarray(observation[:3], np.float64), 0.08 * float(observation[10])
        tip = np.asarray(below_tcp(observation, tip_m), np.float64)
        moment = Moment(tool, tip, truth.object, truth.goal, width_m)
        return np.tile(act(task, moment, speed), (count, 1))

    chooser = Chooser(propose, ALONE, facts.adapters["paper"], robot_task.action_size, 0)
    return Session.of(rig, robot_task, chooser, log, facts.horizon)


def told(task: str, episodes: tuple[EpisodeResult, ...], ended: str) -> dict[str, object]:
    """The session in numbers."""
    good = [each.steps_to_success for each in episodes if each.ended == "success"]
    late = np.array([each.timing.lateness_p99_ms for each in episodes])
    return {
        "task": task,
        "episodes": len(episodes),
        "successes": len(good),
        "steps_mean": float(np.mean(good)) if good else None,
        "steps": good,
        "faults": [each.verdict.cause for each in episodes if each.ended == "fault"],
        "lateness_p99_ms_median": float(np.median(late)) if len(late) else None,
        "lateness_max_ms": max((each.timing.lateness_max_ms for each in episodes), default=None),
        "overruns": sum(each.timing.overruns for each in episodes),
        "ended": ended,
    }


def run(task: str, address: str | None, chosen: argparse.Namespace) -> dict[str, object]:
    """The task's episodes."""
    with tempfile.TemporaryDirectory() as folder:
        running = session(task, address, chosen.speed, Path(folder) / "steps.jsonl")
        begun_s = time.perf_counter()
        done = running.run(range(chosen.episodes))
        took_s = time.perf_counter() - begun_s
    return {
        "twin": "served" if address else "fast",
        **told(task, done.episodes, done.ended),
        "took_s": took_s,
    }


def run_served(task: str, chosen: argparse.Namespace) -> dict[str, object]:
    """The same on a twin of its own; what its server complained of is told, too."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "twin.log"
        with served(task, ADDRESS, START_SEED, log):
            facts = run(task, ADDRESS, chosen)
        lines = log.read_text().splitlines()
    slow = [float(each.split(" at ")[1].split("x")[0]) for each in lines if "real time" in each]
    return {**facts, "server_errors": sum(" ERROR " in each for each in lines), "slower_than_real_time": slow}


def main() -> None:
    """Read the command line; one line of JSON per task."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--served", action="store_true", help="over the Franka Control Interface's protocol")
    parser.add_argument("--tasks", nargs="*", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--episodes", type=int, default=15)
    parser.add_argument("--speed", type=float, default=1.0, help="share of the longest step; default: 1")
    chosen = parser.parse_args()
    if chosen.served:
        sys.stderr.write(raise_priority())
    for task in chosen.tasks:
        facts = run_served(task, chosen) if chosen.served else run(task, None, chosen)
        sys.stdout.write(json.dumps({**facts, "load_average": os.getloadavg()[0]}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
