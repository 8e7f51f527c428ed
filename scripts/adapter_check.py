"""Two controls that learn nothing, per task and adapter family of a suite, and pictures of what adapters see.

`greedy` follows the adapter's direction at full speed, slower near its end, with a hand-written gripper rule.
`random` lets HCPG blend four uniformly random proposals. Where these succeed, a learned policy's success on
the task says little about learning. Prints success once and at the end, steps to it (failures count the
whole episode) and reward per step, with the number of episodes and the seed of their start states. With
`--pictures` the first greedy episode is drawn: tool, object, goal, both directions and the gate.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg import registry
from hcpg.interfaces import Environment, ReadScene, Task
from hcpg.selection import select
from hcpg.tasks import maniskill
from hcpg.tasks.metaworld import OBJECT, tip
from hcpg.types import Float, Scene

TASKS = {
    "metaworld": ("button-press", "drawer-open", "door-open", "sweep-into", "peg-insert-side", "lever-pull"),
    "maniskill": ("push-cube", "pull-cube", "pick-cube", "pick-cube-lift", "poke-cube"),
}
STEPS = {"metaworld": 250, "maniskill": maniskill.HORIZON}
GATE_RADIUS_M, GRASP_RADIUS_M = 0.08, 0.03
SLOW_RADIUS_M = {"metaworld": 0.04, "maniskill": 0.1}
"""The hand is slower than full speed this near to its target; ManiSkill's moves four times as fast."""
SLOW_PUSH_M = {"maniskill/poke-cube": 0.2, "maniskill/poke-cube-delta-pos": 0.2}
"""The same after contact, where the object would slide on by itself."""
KEPT_OPEN = ("drawer-open", "lever-pull")
CLOSED_AT_THE_OBJECT = ("sweep-into", "peg-insert-side")
PUSHES = ("push", "pull")
GRASP_MIDDLE_M = 0.015
PROPOSALS = 4

Act = Callable[[Float[np.ndarray, " O"]], Float[np.ndarray, " A"]]
Grip = Callable[[Float[np.ndarray, " O"], Scene], float]


class Outcome(NamedTuple):
    """Means over episodes."""

    success: float
    steps: float
    reward_per_step: float
    success_at_end: float


def is_in_contact(scene: Scene) -> bool:
    """The gate as HCPG decides it."""
    near = np.linalg.norm(scene.approach) < GATE_RADIUS_M
    return bool(near if scene.contact is None else scene.contact > 0.5)


def follow(name: str, task: Task, read_scene: ReadScene) -> Act:
    """The adapter's own direction, and fingers that do what the task needs."""
    grip = _metaworld_grip(name, task) if task.suite == "metaworld" else _maniskill_grip(name)
    slow_m = SLOW_RADIUS_M[task.suite]
    slow_push_m = SLOW_PUSH_M.get(f"{task.suite}/{name}", slow_m)
    turns = registry.suite(task.suite).spec(task).action_size - 4

    def act(observation: Float[np.ndarray, " O"]) -> Float[np.ndarray, " A"]:
        scene = read_scene(observation)
        contact = is_in_contact(scene)
        vector = scene.task if contact else scene.approach
        distance = float(np.linalg.norm(vector))
        speed = min(1.0, distance / (slow_push_m if contact else slow_m)) / max(distance, 1e-6)
        move = np.concatenate([vector * speed, np.zeros(turns), [grip(observation, scene)]])
        return move.astype(np.float32)

    return act


def _metaworld_grip(name: str, task: Task) -> Grip:
    grasps = name in CLOSED_AT_THE_OBJECT or getattr(task.adapters["contact"], "grasps", False)

    def grip(observation: Float[np.ndarray, " O"], scene: Scene) -> float:
        near = np.linalg.norm(observation[OBJECT] - tip(observation)) < GRASP_RADIUS_M
        return 1.0 if (near if grasps else name not in KEPT_OPEN) else -1.0

    return grip


def _maniskill_grip(name: str) -> Grip:
    def grip(observation: Float[np.ndarray, " O"], scene: Scene) -> float:
        near = np.linalg.norm(scene.approach) < GRASP_MIDDLE_M or (scene.contact or 0.0) > 0.5
        return maniskill.CLOSE if name.startswith(PUSHES) or near else maniskill.OPEN

    return grip


def blend_noise(read_scene: ReadScene, seed: int, size: int = 4) -> Act:
    """HCPG over proposals of `size` entries that know nothing."""
    random = np.random.default_rng(seed)

    def act(observation: Float[np.ndarray, " O"]) -> Float[np.ndarray, " A"]:
        proposals = random.uniform(-1, 1, (PROPOSALS, size)).astype(np.float32)
        return select(proposals, read_scene(observation))[0]

    return act


def measure(environment: Environment, act: Act, episodes: int, steps: int, whole: bool = False) -> Outcome:
    """Run episodes from the first start states; each ends at its first success, or goes on (`whole`)."""
    rows = []
    for start in range(episodes):
        observation, rewards, succeeded = environment.reset(start), [], []
        while len(rewards) < steps and (whole or not any(succeeded)):
            observation, reward, _, success = environment.step(act(observation))
            rewards.append(reward)
            succeeded.append(success)
        first = succeeded.index(True) + 1 if any(succeeded) else steps
        rows.append((any(succeeded), first, np.mean(rewards), succeeded[-1]))
    return Outcome(*np.mean(np.asarray(rows, float), axis=0))


def controls_of(name: str, task: Task, seed: int) -> list[tuple[str, str, Act]]:
    """Adapter family, name and policy of each control."""
    size = registry.suite(task.suite).spec(task).action_size
    return [
        (family, control, act)
        for family, read_scene in task.adapters.items()
        for control, act in (
            ("greedy", follow(name, task, read_scene)),
            ("random", blend_noise(read_scene, seed, size)),
        )
    ]


def check(name: str, task: Task, chosen: argparse.Namespace) -> None:
    """Print a task's rows and draw its pictures."""
    environment = registry.suite(task.suite).make(task, chosen.seed)
    steps, whole = chosen.steps or STEPS[task.suite], task.suite == "maniskill"
    for family, control, act in controls_of(name, task, chosen.seed):
        got = measure(environment, act, chosen.episodes, steps, whole)
        numbers = f"{got.success:8.0%}{got.success_at_end:8.0%}{got.steps:7.0f}{got.reward_per_step:8.2f}"
        print(f"{name:26}{family:9}{control:9}{numbers}", flush=True)
        if chosen.pictures and control == "greedy":
            from adapter_pictures import draw

            read_scene = task.adapters[family]
            file = chosen.pictures / f"{task.suite}_{name}_{family}.png"
            print(f"  drawn: {draw(environment, act, read_scene, steps, file)}", flush=True)
    environment.close()


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--suite", choices=TASKS, default="metaworld")
    parser.add_argument("--episodes", type=int, default=10, help="per task, adapter family and control")
    parser.add_argument("--seed", type=int, default=0, help="of the start states, and of the proposals")
    parser.add_argument("--steps", type=int, help="at most, per episode; default: 250, ManiSkill 50")
    parser.add_argument("--tasks", nargs="+", help="names without the suite")
    parser.add_argument("--pictures", type=Path, help="folder for a picture per task and adapter family")
    chosen = parser.parse_args()
    steps = chosen.steps or STEPS[chosen.suite]
    print(f"{chosen.suite}: {chosen.episodes} episodes of at most {steps} steps, seed {chosen.seed}")
    print(f"{'task':26}{'adapter':9}{'control':9}{'success':>8}{'at end':>8}{'steps':>7}{'reward':>8}")
    for name in chosen.tasks or TASKS[chosen.suite]:
        check(name, registry.task(f"{chosen.suite}/{name}"), chosen)


if __name__ == "__main__":
    main()
