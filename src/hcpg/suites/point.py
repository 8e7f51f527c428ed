"""A point gripper that reaches, grasps and carries: no simulator, and an optimum known on paper.

One step moves the tool by at most 0.02 m along each axis. The gripper has a spring: it closes only under a
firm command (above 0.5) and takes seven steps of full command, so that a random or averaged command holds
nothing.
"""

import math

import numpy as np

from hcpg.interfaces import Environment, Task
from hcpg.types import Float, Spec, Step, UInt8

STRIDE_M = 0.02
"""Motion of the tool along one axis at full command, per step."""
RADIUS_M = 0.02
"""Tool to object at a grasp, and object to goal at success: at most this far apart."""
FALL_M = 0.04
"""How far an object nobody holds falls in one step."""
REST_M = 0.02
"""Height of the object's centre on the table."""
SPRING, RATE = 0.5, 0.25
"""The opening changes by `RATE * (SPRING - command)` in one step: it grows unless the command is firm."""
CLOSED = 0.2
"""The fingers hold at this opening and below; 1 is fully open."""
CLOSING_STEPS = 7
"""Full closing commands from 1 to below `CLOSED`: 1 - 7 * 0.125 = 0.125."""
LOW = np.array([-0.25, -0.25, 0.0])
HIGH = np.array([0.25, 0.25, 0.35])
"""Corners of the tool's workspace, m."""
VARIANTS = ("reach", "carry")
OBSERVATION_SIZE, ACTION_SIZE = 11, 4
PICTURE_PIXELS, VIEW_M = 240, 0.56
"""Side of each square view."""
Ink = tuple[int, int, int]
PAPER, WORKSPACE, TOOL = (232, 232, 228), (250, 250, 248), (52, 58, 70)
OBJECT, HELD, GOAL = (214, 120, 44), (190, 48, 48), (38, 140, 92)


class PointEnvironment:
    """One point gripper; observation: tool (3), opening, object (3), goal (3), held."""

    def __init__(self, variant: str, seed: int) -> None:
        self._carries, self._seed = variant == "carry", seed
        self.reset(0)

    def reset(self, start: int) -> Float[np.ndarray, " O"]:
        """The first observation of start state `start`: fingers open, object on the table."""
        random = np.random.default_rng([self._seed, start])
        self._tool = random.uniform([-0.1, -0.1, 0.12], [0.1, 0.1, 0.25])
        self._object = random.uniform([-0.2, -0.2, REST_M], [0.2, 0.2, REST_M])
        self._goal = random.uniform([-0.2, -0.2, 0.1], [0.2, 0.2, 0.25])
        self._opening, self._held = 1.0, False
        return self._observe()

    def step(self, action: Float[np.ndarray, " A"]) -> Step:
        """Move the tool, then the fingers; the reward lies in [0, 1].

        Raises:
            ValueError: the action is not four finite numbers.
        """
        if action.shape != (ACTION_SIZE,) or not math.isfinite(action.sum()):
            raise ValueError(f"an action of point is four finite numbers in [-1, 1], got {action}")
        command = np.minimum(np.maximum(action, -1.0), 1.0).astype(np.float64)
        before = self._tool
        self._tool = np.minimum(np.maximum(before + STRIDE_M * command[:3], LOW), HIGH)
        if self._held:
            self._object = self._object + (self._tool - before)
        self._move_fingers(float(command[3]))
        reward, success = self._judge()
        return Step(self._observe(), reward, False, success)

    def render(self) -> UInt8[np.ndarray, "H W 3"]:
        """The view from above beside the view from the front."""
        from_above = self._draw(across=0, up=1)
        from_front = self._draw(across=0, up=2)
        return np.concatenate([from_above, from_front], axis=1)

    def close(self) -> None:
        """Nothing to free."""

    def _move_fingers(self, command: float) -> None:
        was_open = self._opening > CLOSED
        self._opening = min(max(self._opening + RATE * (SPRING - command), 0.0), 1.0)
        closed = self._opening <= CLOSED
        grasps = was_open and closed and _distance(self._tool, self._object) <= RADIUS_M
        self._held = closed and (self._held or grasps)
        if not self._held and self._object[2] > REST_M:
            self._object[2] = max(self._object[2] - FALL_M, REST_M)

    def _judge(self) -> tuple[float, bool]:
        reach = _distance(self._tool, self._object)
        near = 1.0 - math.tanh(reach / 0.1)
        if not self._carries:
            return near, reach <= RADIUS_M
        carry = _distance(self._object, self._goal)
        firm = 1.0 if self._held else (1.0 - self._opening) * (reach <= RADIUS_M) / 2
        placed = (1.0 - math.tanh(carry / 0.1)) * self._held
        return 0.2 * near + 0.2 * firm + 0.6 * placed, carry <= RADIUS_M

    def _draw(self, across: int, up: int) -> UInt8[np.ndarray, "S S 3"]:
        """One square view; `across` and `up` are the axes to the right and to the top."""
        picture = np.full((PICTURE_PIXELS, PICTURE_PIXELS, 3), PAPER, np.uint8)
        middle, half = (LOW + HIGH) / 2, (HIGH - LOW) / 2
        metres = (np.arange(PICTURE_PIXELS) + 0.5) / PICTURE_PIXELS * VIEW_M - VIEW_M / 2
        right, top = middle[across] + metres, (middle[up] - metres)[:, None]

        def paint(
            centre: Float[np.ndarray, " 3"], half_width_m: float, half_height_m: float, ink: Ink
        ) -> None:
            inside_across = np.abs(right - centre[across]) <= half_width_m
            picture[inside_across & (np.abs(top - centre[up]) <= half_height_m)] = ink

        def ring(centre: Float[np.ndarray, " 3"], radius_m: float, ink: Ink) -> None:
            distance = np.hypot(right - centre[across], top - centre[up])
            picture[np.abs(distance - radius_m) <= VIEW_M / PICTURE_PIXELS] = ink

        paint(middle, half[across], half[up], WORKSPACE)
        ring(self._goal, RADIUS_M, GOAL)
        ring(self._goal, RADIUS_M / 4, GOAL)
        paint(self._object, 0.012, 0.012, HELD if self._held else OBJECT)
        gap_m = 0.015 + 0.015 * self._opening
        axes = np.eye(3)
        for side in (-gap_m, gap_m):
            paint(self._tool + side * axes[across], 0.003, 0.015, TOOL)
        paint(self._tool + 0.018 * axes[up], gap_m + 0.003, 0.003, TOOL)
        return picture

    def _observe(self) -> Float[np.ndarray, " O"]:
        observation = np.empty(OBSERVATION_SIZE, np.float32)
        observation[0:3] = self._tool
        observation[3] = self._opening
        observation[4:7] = self._object
        observation[7:10] = self._goal
        observation[10] = self._held
        return observation


class PointSuite:
    """The built-in suite."""

    def spec(self, task: Task) -> Spec:
        """11 observed numbers, 4 commanded."""
        return Spec(OBSERVATION_SIZE, ACTION_SIZE)

    def make(self, task: Task, seed: int) -> Environment:
        """A point gripper of the variant `task.env_id`.

        Raises:
            ValueError: no such variant.
        """
        if task.env_id not in VARIANTS:
            raise ValueError(f"point has no variant {task.env_id!r}; it has {', '.join(VARIANTS)}")
        return PointEnvironment(task.env_id, seed)


SUITE = PointSuite()


def steps_between(start: Float[np.ndarray, " 3"], target: Float[np.ndarray, " 3"]) -> int:
    """The fewest steps that bring a point within `RADIUS_M` of the target.

    After n steps the point can be anywhere in a cube of half-width n * STRIDE_M around its start.
    """
    apart = np.abs(np.asarray(target, np.float64) - np.asarray(start, np.float64))
    steps = 0
    while np.linalg.norm(np.maximum(apart - steps * STRIDE_M, 0.0)) > RADIUS_M:
        steps += 1
    return steps


def optimal_steps(task: Task, first: Float[np.ndarray, " O"]) -> int:
    """The fewest steps to success from a first observation.

    `reach` ends when the tool is there. `carry` closes the fingers on the way, so that they meet the moment
    the tool arrives, but no sooner than `CLOSING_STEPS`; only from the next step on does the object move.
    """
    reach = steps_between(first[0:3], first[4:7])
    if task.env_id == "reach":
        return reach
    return max(reach, CLOSING_STEPS) + steps_between(first[4:7], first[7:10])


def _distance(one: Float[np.ndarray, " 3"], other: Float[np.ndarray, " 3"]) -> float:
    return math.dist(one.tolist(), other.tolist())
