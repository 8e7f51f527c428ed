"""The fast twin of a Franka arm for training: 30 steps a simulated second, under the arm's own limits.

An episode sees what it would see on the arm: a touched-off or a photographed position of the object, late,
noisy and with gaps; its reward is for what is true. Every number made here is a number of the twin.
"""

import atexit

import numpy as np

from hcpg.interfaces import Environment, RobotTask, Task
from hcpg.perception.truth import NoisyTruth, Poorness
from hcpg.robot_types import Sight, Sighting, Snapshot
from hcpg.safety.limiting import Limited, Motion, limit, unfit
from hcpg.twin.drawing import Drawing
from hcpg.twin.experts import Moment, act
from hcpg.twin.judging import Truth
from hcpg.twin.limits import limits
from hcpg.twin.physics import TICK_S
from hcpg.twin.scenes import scene
from hcpg.twin.world import World
from hcpg.types import Float, Spec, Step, UInt8

NEAR_M = 0.1
"""Scale of the reward for coming near."""
LOOKED_S = 0.5
"""Perception has been looking for so long when an episode begins."""
PICTURE_PIXELS = 480


class FrankaEnvironment:
    """One task on the fast twin; the reward lies in [0, 1]."""

    def __init__(self, task: Task, robot: RobotTask, seed: int) -> None:
        self._robot, self._seed = robot, seed
        self._limits = limits(task.env_id)
        self._world = World(task.env_id, seed)
        self._drawing: Drawing | None = None
        self.reset(0)

    def reset(self, start: int) -> Float[np.ndarray, " O"]:
        """The first observation of start state `start`: the arm near its home, at rest."""
        self._world.place(start)
        self._target, self._running_s = None, 0.0
        self._fixed = {name: Sighting(place, np.inf) for name, place in self._world.surveyed().items()}
        camera = Poorness(**self._world.scene.camera._asdict())
        seed = int(np.random.default_rng([self._seed, start]).integers(2**32))
        self._eyes = NoisyTruth(self._world.moving, camera, seed)
        for past_s in np.arange(0.0, LOOKED_S, TICK_S):
            self._eyes.look(self._snapshot(), float(past_s))
        return self._observe()

    def step(self, action: Float[np.ndarray, " A"]) -> Step:
        """One thirtieth of a second; success means "now", and the episode goes on after it.

        Raises:
            ValueError: the action is not as many finite numbers as the task takes.
        """
        reason = unfit(action, self._robot.action_size)
        if reason:
            raise ValueError(f"{reason}; an action of this task is in [-1, 1]")
        self._carry_out(limit(action, self._snapshot(), self._limits, self._motion()))
        self._world.sleep_until(self._world.now_s() + TICK_S)
        truth = self._world.truth()
        return Step(self._observe(), _reward(truth), False, truth.done)

    def expert(self, speed: float = 1.0) -> Float[np.ndarray, " A"]:
        """What the scripted expert would do now, at a share of full speed in (0, 1]; it sees the truth."""
        truth, physics = self._world.truth(), self._world.physics
        moment = Moment(physics.position, truth.tip, truth.object, truth.goal, physics.width_m)
        return act(self._world.task, moment, speed)

    def render(self) -> UInt8[np.ndarray, "H W 3"]:
        """The table from the side; works without a display.

        Raises:
            DrawingError: a library for OpenGL is missing.
        """
        if self._drawing is None:
            self._drawing = Drawing(self._world.physics.model, PICTURE_PIXELS)
            # Left to the interpreter's end, a context outlives the library that it frees itself with.
            atexit.register(self.close)
        return self._drawing.picture(self._world.physics.data)

    def close(self) -> None:
        """Free what draws, where it was opened; safe to call twice."""
        if self._drawing is not None:
            self._drawing.close()
            self._drawing = None
            atexit.unregister(self.close)

    def _motion(self) -> Motion:
        return Motion(self._target, TICK_S, self._running_s)

    def _carry_out(self, limited: Limited) -> None:
        self._world.physics.aim(limited.position)
        if limited.grip != "keep":
            self._world.physics.grip = limited.grip
        self._target = limited.position
        self._running_s += TICK_S

    def _snapshot(self) -> Snapshot:
        return self._world.snapshot(epoch=1, begun_s=LOOKED_S)

    def _observe(self) -> Float[np.ndarray, " O"]:
        snapshot = self._snapshot()
        sight: Sight = {**self._fixed, **self._eyes.look(snapshot, snapshot.host_time_s)}
        return self._robot.observe(snapshot, sight)


class FrankaSuite:
    """The suite of the four tasks, on the fast twin."""

    def spec(self, task: Task) -> Spec:
        """19 observed numbers; 3 commanded, 4 where the gripper is."""
        robot = _robot(task)
        return Spec(robot.observation_size, robot.action_size)

    def make(self, task: Task, seed: int) -> Environment:
        """An environment whose start states are the set that `seed` names.

        Raises:
            ValueError: the twin has no such task, or the seed is negative.
        """
        scene(task.env_id)
        if seed < 0:
            raise ValueError(f"a seed of franka is an integer >= 0, got {seed}")
        return FrankaEnvironment(task, _robot(task), seed)


SUITE = FrankaSuite()


def _robot(task: Task) -> RobotTask:
    if task.robot is None:
        raise ValueError(
            f"{task.env_id!r} says nothing of an arm; give its Task a RobotTask, as in tasks/franka"
        )
    return task.robot


def _reward(truth: Truth) -> float:
    """A fifth for coming near, the rest for the part of the task that is done."""
    return 0.2 * (1.0 - float(np.tanh(truth.reach_m / NEAR_M))) + 0.8 * truth.progress
