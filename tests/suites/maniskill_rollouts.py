"""One rollout of each ManiSkill task; run as a program it prints what a machine of its own comes to."""

import sys

import numpy as np

from hcpg import registry
from hcpg.suites.maniskill import control_mode
from hcpg.suites.maniskill.building import build_simulation
from hcpg.suites.maniskill.stepping import TorchStepping

NAMES = ("push-cube", "pull-cube", "pick-cube", "poke-cube")
STEPS = 30


def rollout(name, simulation):
    """A row for the reset and each step, under the task's own directions: the hand touches something.

    Only the first one of a simulation is like a fresh one's: ManiSkill's reset leaves contacts behind.
    """
    task, stepping = registry.task(f"maniskill/{name}"), TorchStepping(simulation)
    random = np.random.default_rng(0)
    size = registry.suite("maniskill").spec(task).action_size
    rows = [np.append(stepping.reset(11), [0.0, 0.0])]
    for _ in range(STEPS):
        scene = task.adapters["contact"](rows[-1][:-2])
        action = 0.1 * random.uniform(-1, 1, size).astype(np.float32)
        action[:3] += np.clip((scene.task if scene.contact > 0.5 else scene.approach) / 0.1, -1, 1)
        action[-1] = -1.0 if np.linalg.norm(scene.approach) < 0.02 or name.startswith("pu") else 1.0
        observation, reward, success = stepping.step(action)
        rows.append(np.append(observation, [reward, success]))
    return np.asarray(rows, np.float32)


def without_visuals(name):
    """The rollout of the environment that training uses."""
    task = registry.task(f"maniskill/{name}")
    simulation = build_simulation(task.env_id, control_mode(task))
    rows = rollout(name, simulation)
    simulation.close()
    return rows


def main():
    """Save the rollouts, then try to draw and go on stepping."""
    np.savez(sys.argv[1], **{name: without_visuals(name) for name in NAMES})
    environment = registry.suite("maniskill").make(registry.task("maniskill/push-cube"), 0)
    environment.reset(0)
    try:
        environment.render()
    except RuntimeError as error:
        print(type(error).__name__, error)  # noqa: T201 - the answer
    print(environment.step(np.zeros(4, np.float32)).observation.shape)  # noqa: T201 - the answer


if __name__ == "__main__":
    main()
