"""Two controls that learn nothing, per Meta-World task and adapter family.

`greedy` follows the adapter's direction at full speed, slower near its end, with a hand-written gripper rule.
`random` lets HCPG blend four uniformly random proposals. Where these succeed, a learned policy's success on
the task says little about learning. Prints success once, steps to it (failures count the whole episode) and
reward per step, with the number of episodes and the seed of their start states.
"""

import argparse
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hcpg import registry
from hcpg.interfaces import Environment, ReadScene, Task
from hcpg.selection import select
from hcpg.tasks.metaworld import OBJECT, tip
from hcpg.types import Float

PAPER_TASKS = ("button-press", "drawer-open", "door-open", "sweep-into", "peg-insert-side", "lever-pull")
GATE_RADIUS_M, GRASP_RADIUS_M, SLOW_RADIUS_M = 0.08, 0.03, 0.04
KEPT_OPEN = ("drawer-open", "lever-pull")
CLOSED_AT_THE_OBJECT = ("sweep-into", "peg-insert-side")
PROPOSALS = 4

Act = Callable[[Float[np.ndarray, " O"]], Float[np.ndarray, " A"]]


class Outcome(NamedTuple):
    """Means over episodes."""

    success: float
    steps: float
    reward_per_step: float


def follow(name: str, task: Task, read_scene: ReadScene) -> Act:
    """The adapter's own direction, and fingers that do what the task needs."""
    grasps = name in CLOSED_AT_THE_OBJECT or getattr(task.adapters["contact"], "grasps", False)

    def act(observation: Float[np.ndarray, " O"]) -> Float[np.ndarray, " A"]:
        scene = read_scene(observation)
        gate = np.linalg.norm(scene.approach) < GATE_RADIUS_M
        vector = scene.task if (gate if scene.contact is None else scene.contact > 0.5) else scene.approach
        distance = float(np.linalg.norm(vector))
        near = np.linalg.norm(observation[OBJECT] - tip(observation)) < GRASP_RADIUS_M
        closes = near if grasps else name not in KEPT_OPEN
        speed = min(1.0, distance / SLOW_RADIUS_M) / max(distance, 1e-6)
        return np.append(vector * speed, 1.0 if closes else -1.0).astype(np.float32)

    return act


def blend_noise(read_scene: ReadScene, seed: int) -> Act:
    """HCPG over proposals that know nothing."""
    random = np.random.default_rng(seed)

    def act(observation: Float[np.ndarray, " O"]) -> Float[np.ndarray, " A"]:
        proposals = random.uniform(-1, 1, (PROPOSALS, 4)).astype(np.float32)
        return select(proposals, read_scene(observation))[0]

    return act


def measure(environment: Environment, act: Act, episodes: int, steps: int) -> Outcome:
    """Run episodes from the first start states; each ends at its first success."""
    rows = []
    for start in range(episodes):
        observation, rewards, success = environment.reset(start), [], False
        for _ in range(steps):
            observation, reward, _, success = environment.step(act(observation))
            rewards.append(reward)
            if success:
                break
        rows.append((success, len(rewards) if success else steps, np.mean(rewards)))
    return Outcome(*np.mean(np.asarray(rows, float), axis=0))


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--episodes", type=int, default=10, help="per task, adapter family and control")
    parser.add_argument("--seed", type=int, default=0, help="of the start states, and of the proposals")
    parser.add_argument("--steps", type=int, default=250, help="at most, per episode")
    parser.add_argument("--tasks", nargs="+", default=PAPER_TASKS, help="names without the suite")
    chosen = parser.parse_args()
    print(f"{chosen.episodes} episodes of at most {chosen.steps} steps, seed {chosen.seed}")
    print(f"{'task':26}{'adapter':9}{'control':9}{'success':>8}{'steps':>7}{'reward':>8}")
    for name in chosen.tasks:
        task = registry.task(f"metaworld/{name}")
        environment = registry.suite(task.suite).make(task, chosen.seed)
        for family, read_scene in task.adapters.items():
            controls = {
                "greedy": follow(name, task, read_scene),
                "random": blend_noise(read_scene, chosen.seed),
            }
            for control, act in controls.items():
                got = measure(environment, act, chosen.episodes, chosen.steps)
                numbers = f"{got.success:8.0%}{got.steps:7.0f}{got.reward_per_step:8.2f}"
                print(f"{name:26}{family:9}{control:9}{numbers}", flush=True)
        environment.close()


if __name__ == "__main__":
    main()
