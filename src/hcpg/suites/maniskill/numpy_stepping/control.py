"""From an action to drive targets, as ManiSkill's `pd_ee_delta_pos` and `pd_ee_delta_pose` take it.

The target pose is reckoned here; the joints that reach it come from the same solver that ManiSkill asks.
"""

import importlib
from typing import Any

import numpy as np

from hcpg.suites.maniskill.numpy_stepping import poses
from hcpg.suites.maniskill.numpy_stepping.poses import ONE, TWO, ZERO, Pose, Quaternion
from hcpg.types import Float

MODES = ("pd_ee_delta_pos", "pd_ee_delta_pose")
LONGEST_SEARCH = 100
"""Iterations after which ManiSkill gives an unreachable pose up."""


class EndEffectorControl:
    """Turns the actions of one simulation into the drive targets of its joints."""

    def __init__(self, simulation: Any) -> None:
        """Bind to a simulation that ManiSkill has built.

        Raises:
            ValueError: it takes its actions in another control mode than those in `MODES`.
        """
        mode = simulation.agent.control_mode
        if mode not in MODES:
            raise ValueError(f"actions of control mode {mode!r} are not known here, only {', '.join(MODES)}")
        controllers = simulation.agent.controller.controllers
        arm, gripper = controllers["arm"], controllers["gripper"]
        self._articulation = simulation.agent.robot._objs[0]
        self._root, self._hand = arm.root_link._objs[0], arm.ee_link._objs[0]
        self._arm_joints = [joint._objs[0] for joint in arm.joints]
        self._fingers = [joint._objs[0] for joint in gripper.joints]
        self._middle, self._half = _middle_and_half(arm, slice(0, 3))
        self._finger_middle, self._finger_half = _middle_and_half(gripper, slice(0, 1))
        self._turn = _Turn(arm.config.rot_lower) if hasattr(arm.config, "rot_lower") else None
        self._solver = _Solver(arm.kinematics)

    def set_targets(self, action: Float[np.ndarray, " A"]) -> None:
        """Drive the joints to where one action, in [-1, 1], sends hand and fingers; outside, it is clipped.

        A pose that no joints reach leaves the arm where it is.
        """
        action, qpos = action.astype(np.float32), self._articulation.qpos
        solved = self._solver.solve(self._target(action), qpos)
        targets = (qpos[: len(self._arm_joints)] if solved is None else solved).tolist()
        for joint, target in zip(self._arm_joints, targets, strict=True):
            joint.set_drive_target(target)
        finger = float((self._finger_middle + self._finger_half * _clipped(action[-1:]))[0])
        for joint in self._fingers:
            joint.set_drive_target(finger)

    def _target(self, action: Float[np.ndarray, " A"]) -> Pose:
        base = poses.inverse(poses.read(self._root.entity_pose))
        position, rotation = poses.compose(base, poses.read(self._hand.entity_pose))
        shift = tuple(self._middle + self._half * _clipped(action[:3]))
        turn = (ONE, ZERO, ZERO, ZERO) if self._turn is None else self._turn.quaternion(action[3:6])
        return poses.add(position, shift), poses.turn(turn, rotation)


class _Solver:
    """The inverse kinematics of SAPIEN's robot model, asked as ManiSkill asks it."""

    def __init__(self, kinematics: Any) -> None:
        self._pose_class = importlib.import_module("sapien").Pose
        self._model, self._link = kinematics.pmodel, kinematics.end_link_idx
        self._order = kinematics.pmodel_active_joint_indices.numpy()
        self._controlled = kinematics.pmodel_controlled_joint_indices.numpy()
        self._mask = kinematics.qmask.numpy().astype(np.int32)

    def solve(self, target: Pose, qpos: Float[np.ndarray, " Q"]) -> Float[np.ndarray, " J"] | None:
        """Positions of the controlled joints, rad; none where the search did not arrive."""
        result, arrived, _ = self._model.compute_inverse_kinematics(
            self._link,
            self._pose_class(*target),
            initial_qpos=qpos[self._order],
            active_qmask=self._mask,
            max_iterations=LONGEST_SEARCH,
        )
        return result[self._controlled].astype(np.float32) if arrived else None


class _Turn:
    """The rotation that the last three numbers of a `pd_ee_delta_pose` action ask for.

    Sine, cosine, square root and norm are PyTorch's: their last bit is a library's own.
    """

    def __init__(self, lower: float) -> None:
        self._lower = np.float32(lower)
        self._torch: Any = importlib.import_module("torch")

    def quaternion(self, turns: Float[np.ndarray, " 3"]) -> Quaternion:
        """Of turns about x, y and z: at most a unit vector, times the lower bound (so the sign turns)."""
        length = self._of(self._torch.linalg.norm, turns)
        if length > 1:
            turns = turns * (ONE / length)
        angles = turns * self._lower
        (cx, cy, cz), (sx, sy, sz) = (self._of(f, angles) for f in (self._torch.cos, self._torch.sin))
        xy, zy = sx * sy, -cx * sy
        trace = ONE + cy * cz + (xy * -sz + cx * cz) + cx * cy
        scalar = self._of(self._torch.sqrt, np.array([trace]))[0]
        x = (zy * -sz + sx * cz) - -sx * cy
        y = sy - (zy * cz + sx * sz)
        z = (xy * cz + cx * sz) - -cy * sz
        # Of the four ways to read a quaternion from a matrix, ManiSkill takes this one for small angles.
        return tuple(part / (TWO * scalar) for part in (scalar * scalar, x, y, z))

    def _of(self, function: Any, values: np.ndarray) -> np.ndarray:
        return function(self._torch.from_numpy(values)).numpy()


def _middle_and_half(controller: Any, part: slice) -> tuple[np.ndarray, np.ndarray]:
    """Centre of what a controller commands, and half its width, per number of the action."""
    low, high = (bound.numpy()[part] for bound in (controller.action_space_low, controller.action_space_high))
    return 0.5 * (high + low), 0.5 * (high - low)


def _clipped(numbers: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    return np.minimum(np.maximum(numbers, -1), 1)
