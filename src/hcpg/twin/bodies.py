"""Where a scene's parts are in the simulator's arrays; how they are put in place, moved and read."""

import importlib
from typing import Any, NamedTuple

import numpy as np

from hcpg.twin.scenes import Layout
from hcpg.types import Float

HOME_ANGLES = np.array([0.0, -0.35, 0.0, -2.5, 0.0, 2.15, 0.785])
"""Joint angles with the hand down in front of the base, rad; the start of every search."""
FLANGE_M = 0.107
"""From the seventh link's frame to the flange, along z."""
HAND_M = 0.1034
"""From the flange to the TCP between the finger pads, along z; the hand is turned by -45 degrees about it."""
FINGER_STIFFNESS_N_M, FINGER_DAMPING_N_S_M, FINGER_FORCE_N = 1000.0, 20.0, 100.0
"""Of one finger: franka-sim's hand, so that both twins grip alike."""
_TRIES, _CLOSE_M, _DAMPING = 100, 1e-5, 1e-4


class Addresses(NamedTuple):
    """Indices into a model's arrays; -1 for a joint that the scene does not have."""

    arm: Any
    arm_speeds: Any
    fingers: Any
    finger_speeds: Any
    tcp: int
    tip: int
    object: int

    @classmethod
    def of(cls, model: Any) -> "Addresses":
        """Those of a compiled scene."""
        joints = [model.joint(f"fr3_joint{number}") for number in range(1, 8)]
        fingers = [model.joint(f"fr3_finger_joint{number}") for number in (1, 2)]
        places = [np.array([joint.qposadr[0] for joint in group]) for group in (joints, fingers)]
        speeds = [np.array([joint.dofadr[0] for joint in group]) for group in (joints, fingers)]
        sites = [model.site(name).id for name in ("tcp", "tip", "object")]
        return cls(places[0], speeds[0], places[1], speeds[1], *sites)


def finger_forces(
    target_m: float, places: Float[np.ndarray, " 2"], speeds: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, " 2"]:
    """N on each finger, towards its target."""
    force = FINGER_STIFFNESS_N_M * (target_m - places) - FINGER_DAMPING_N_S_M * speeds
    return np.minimum(np.maximum(force, -FINGER_FORCE_N), FINGER_FORCE_N)


def arrange(model: Any, data: Any, layout: Layout) -> None:
    """Put the things on the table where the layout says, at rest; the arm stays."""
    fixture, half = model.body("fixture"), layout.yaw_rad / 2.0
    quaternion = [np.cos(half), 0.0, 0.0, np.sin(half)]
    if fixture.jntnum[0] == 0:
        model.body_pos[fixture.id], model.body_quat[fixture.id] = layout.fixture, quaternion
    for joint in range(model.njnt):
        name, place, speed = model.joint(joint).name, model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        if name.startswith("fr3_"):
            continue
        if name == "ball":
            data.qpos[place : place + 7] = [*layout.fixture, *quaternion]
            data.qvel[speed : speed + 6] = 0.0
        else:
            data.qpos[place], data.qvel[speed] = layout.opening_m, 0.0


def angles_for(
    model: Any, position: Float[np.ndarray, " 3"], guess: Float[np.ndarray, " 7"]
) -> Float[np.ndarray, " 7"]:
    """Joint angles that put the TCP at `position` with the hand pointing down, by damped least squares.

    Raises:
        ValueError: the arm cannot get there.
    """
    mujoco: Any = importlib.import_module("mujoco")
    from hcpg.twin.impedance import turn

    data, at = mujoco.MjData(model), Addresses.of(model)
    jacobian = np.zeros((6, model.nv))
    data.qpos[at.arm] = guess
    for _ in range(_TRIES):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], at.tcp)
        rotation = data.site_xmat[at.tcp].reshape(3, 3)
        error = np.concatenate([position - data.site_xpos[at.tcp], turn(rotation, np.diag([1.0, -1, -1]))])
        if np.abs(error).max() < _CLOSE_M:
            return data.qpos[at.arm].copy()
        own = jacobian[:, at.arm_speeds]
        data.qpos[at.arm] += own.T @ np.linalg.solve(own @ own.T + _DAMPING * np.eye(6), error)
    raise ValueError(f"the arm cannot reach {position} with its hand down; choose a place in front of it")
