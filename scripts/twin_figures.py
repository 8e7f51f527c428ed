"""Measures the twin, or draws it: `python scripts/twin_figures.py PART --out docs/evidence/twin`.

`speed`: control steps per second. `adapters`: steps to success of whoever follows an adapter's direction,
slower within 4 mm of its end, and closes the hand at the object; there is no learning in it, so what succeeds
says nothing of a policy. `parity`: how far the fast and the served twin are apart (needs `make twin`).
`picture`: each task at its start and done.
"""

import argparse
import itertools
import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from hcpg import registry
from hcpg.interfaces import Robot, Task
from hcpg.robot_types import Command
from hcpg.robots.twin import START_SEED
from hcpg.safety.priority import raise_priority
from hcpg.twin.launching import served
from hcpg.twin.scenes import SCENES

SEED, STARTS, SPEED_STEPS = 100, 15, 300
LONGEST = 200
"""Actions of whoever follows an adapter."""
GATE_M, GAIN, STEP_M, AT_THE_BALL_M = 0.08, 2.5, 0.010, 0.012
ADDRESS, PARITY_TASK, TICK_S, PARITY_TICKS = "127.0.0.6", "button-press", 1.0 / 30.0, 60
NUMBERS = itertools.count(1)


def environment_of(task: Task) -> Any:
    """The fast twin of a task."""
    return registry.suite("franka").make(task, SEED)


def speed(task: Task) -> dict[str, float]:
    """Control steps per second of processor time and of the wall clock, under random actions."""
    environment, random = environment_of(task), np.random.default_rng(0)
    size = registry.suite("franka").spec(task).action_size
    actions = random.uniform(-1, 1, (SPEED_STEPS, size))
    processor_s, wall_s = time.process_time(), time.perf_counter()
    for action in actions:
        environment.step(action)
    done_s = time.process_time() - processor_s, time.perf_counter() - wall_s
    return {"steps_per_processor_s": SPEED_STEPS / done_s[0], "steps_per_wall_s": SPEED_STEPS / done_s[1]}


def greedy(task: Task, family: str) -> dict[str, object]:
    """Steps to success from each start; -1 where there was none."""
    environment, read = environment_of(task), task.adapters[family]
    steps = []
    for start in range(STARTS):
        observation, done = environment.reset(start), -1
        for step in range(min(task.horizon, LONGEST)):
            answer = environment.step(_followed(read(observation), task))
            observation = answer.observation
            if answer.success:
                done = step + 1
                break
        steps.append(done)
    return {"successes": sum(each > 0 for each in steps), "starts": STARTS, "steps": steps}


def _followed(scene: Any, task: Task) -> np.ndarray:
    away = float(np.linalg.norm(scene.object - scene.tool))
    contact = float(scene.contact) > 0.5 if scene.contact is not None else away < GATE_M
    way = scene.task if contact else scene.approach
    length = float(np.linalg.norm(way))
    delta = way / max(length, 1e-9) * min(1.0, GAIN * length / STEP_M)
    if registry.suite("franka").spec(task).action_size == 3:
        return delta
    return np.append(delta, -1.0 if contact or away < AT_THE_BALL_M else 1.0)


def parity(folder: Path) -> dict[str, object]:
    """Distance of the two TCPs under two seconds of the same deltas, each from where its own arm is."""
    turns = np.repeat(np.random.default_rng(3).uniform(-1, 1, (6, 3)) * [0.008, 0.008, 0.006], 10, axis=0)
    raise_priority()
    with served(PARITY_TASK, ADDRESS, START_SEED, folder / "twin.log"):
        paths = [_path(address, turns) for address in (ADDRESS, None)]
    apart_mm = 1000 * np.linalg.norm(paths[0] - paths[1], axis=1)
    travelled_mm = 1000 * np.linalg.norm(np.diff(paths[0], axis=0), axis=1).sum()
    return {
        "ticks": PARITY_TICKS,
        "travelled_mm": float(travelled_mm),
        "apart_max_mm": float(apart_mm.max()),
        "apart_last_mm": float(apart_mm[-1]),
    }


def _path(address: str | None, turns: np.ndarray) -> np.ndarray:
    rig: Any = registry.robot("twin").make(f"franka/{PARITY_TASK}", address)
    rig.robot.connect(10.0)
    for height_m in (0.25, 0.20):
        rig.robot.reset((0.45, 0.0, height_m), "close", 15.0)
    seen = _driven(rig.robot, turns)
    rig.robot.close()
    rig.stage.close()
    return seen - seen[0]


def _driven(robot: Robot, turns: np.ndarray) -> np.ndarray:
    seen, due_s = [], robot.observe().robot_time_s
    for turn in turns:
        while (now := robot.observe()).robot_time_s < due_s - 1e-6:
            robot.clock.sleep_until(robot.clock.now_s() + 0.001)
        seen.append(now.position)
        robot.command(Command(next(NUMBERS), now.epoch, now.position + turn, "keep"))
        due_s += TICK_S
    return np.array(seen)


def picture(path: Path) -> None:
    """Each task at its start (above) and done by the expert (below), side by side."""
    from PIL import Image

    columns = []
    for task in (registry.task(f"franka/{name}") for name in SCENES):
        environment = environment_of(task)
        environment.reset(0)
        views = [environment.render()]
        for _ in range(task.horizon):
            if environment.step(environment.expert()).success:
                break
        views.append(environment.render())
        environment.close()
        columns.append(np.concatenate(views, axis=0))
    Image.fromarray(np.concatenate(columns, axis=1)).save(path, quality=85)


def speeds(_: Path) -> dict[str, object]:
    """Of every task, with the machine's load at the time."""
    tasks = {name: speed(registry.task(f"franka/{name}")) for name in SCENES}
    return {"load_average": os.getloadavg()[0], **tasks}


def adapters(_: Path) -> dict[str, object]:
    """Of every task and both of its adapters."""
    tasks = {name: registry.task(f"franka/{name}") for name in SCENES}
    return {name: {family: greedy(task, family) for family in task.adapters} for name, task in tasks.items()}


PARTS = {"speed": speeds, "adapters": adapters, "parity": parity}


def main() -> None:
    """Read the command line; writes PART.json, or the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=[*PARTS, "picture"])
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    if chosen.part == "picture":
        return picture(chosen.out / "completion_states.jpg")
    with tempfile.TemporaryDirectory() as folder:
        found = PARTS[chosen.part](Path(folder))
    (chosen.out / f"{chosen.part}.json").write_text(json.dumps(found, indent=2) + "\n")
    return None


if __name__ == "__main__":
    main()
