"""Lets the scripted experts do the four tasks on a twin, through the control loop; prints what came of it.

    python scripts/twin_experts.py                         the fast twin
    python scripts/twin_experts.py --address 127.0.0.1 --tasks peg-insertion     one that is served there

The experts see the truth, so the numbers say that scenes, driver and loop work, and nothing of a policy.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from hcpg import registry
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Session
from hcpg.selection import Selector
from hcpg.twin.experts import Moment, act
from hcpg.twin.scenes import SCENES

ALONE = Selector(rule="first", candidates=1)


def session(task: str, address: str | None, speed: float, log: Path) -> tuple[Session, object]:
    """A session in which the expert proposes; and the twin's stage, which knows the truth."""
    rig, robot_task = (
        registry.robot("twin").make(f"franka/{task}", address),
        registry.robot_task(f"franka/{task}"),
    )

    def propose(observation: np.ndarray, count: int, draw: int) -> np.ndarray:
        truth = rig.stage.truth()
        tool, width_m = np.asarray(observation[:3], np.float64), 0.08 * float(observation[10])
        return np.tile(
            act(task, Moment(tool, truth.tip, truth.object, truth.goal, width_m), speed), (count, 1)
        )

    address_of = registry.task(f"franka/{task}")
    chooser = Chooser(propose, ALONE, address_of.adapters["paper"], robot_task.action_size, 0)
    return Session.of(rig, robot_task, chooser, log, address_of.horizon), rig.stage


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


def main() -> None:
    """Read the command line; one line of JSON per task."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--address", help="of a served twin; default: the fast twin, in this process")
    parser.add_argument("--tasks", nargs="*", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--episodes", type=int, default=15)
    parser.add_argument("--speed", type=float, default=1.0)
    chosen = parser.parse_args()
    for task in chosen.tasks:
        with tempfile.TemporaryDirectory() as folder:
            running, _ = session(task, chosen.address, chosen.speed, Path(folder) / "steps.jsonl")
            done = running.run(range(chosen.episodes))
        sys.stdout.write(json.dumps(told(task, done.episodes, done.ended)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
