"""From an action to the target that may be sent: each limit in its turn, each named where it changed it.

The target is the *measured* position plus a delta, so an arm that does not follow never gets a target that
runs away from it. Every limit shortens or turns the delta; the last ones win. Where the arm is inside the box
the target is inside the box, because what comes after the box only shortens the way to it.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from hcpg.robot_types import Grip, Limits, Snapshot
from hcpg.types import Float, Tensor

GRIP_THRESHOLD = 0.5
"""A fourth entry from here up opens the gripper, from minus this down closes it; between, it stays."""
_CHANGED_M = 1e-9
Vector = Float[np.ndarray, " 3"]


class Motion(NamedTuple):
    """What a limit needs to know of the commands before."""

    target: Vector | None
    """The last target sent, m; None after a hold."""
    elapsed_s: float
    """Since it was sent."""
    running_s: float
    """Since the last hold ended; steps grow with it."""


class Limited(NamedTuple):
    """What may be sent, and what it is as an action."""

    position: Vector
    """The target, m."""
    grip: Grip
    executed: Float[np.ndarray, " A"]
    """The action that the target amounts to, in [-1, 1]: what replay stores."""
    touched: tuple[str, ...]
    """Names of the limits that changed the delta, in order."""


class _Case(NamedTuple):
    delta: Vector
    snapshot: Snapshot
    limits: Limits
    motion: Motion


def unfit(action: Tensor, size: int) -> str:
    """Why `action` cannot be an action of `size` numbers; "" where it can."""
    array = np.asarray(action)
    if array.dtype.kind != "f" and array.dtype.kind != "i":
        return f"an action of type {array.dtype}, not of numbers"
    if array.shape != (size,):
        return f"an action of shape {array.shape}, not ({size},)"
    if not np.isfinite(array).all():
        return f"an action that is not finite: {array.tolist()}"
    return ""


def limit(action: Float[Tensor, " A"], snapshot: Snapshot, limits: Limits, motion: Motion) -> Limited:
    """The target for an action of 3 numbers (delta of the position), or 4 (and the gripper).

    One unit is `limits.step_m` along an axis.

    Raises:
        ValueError: the action is not 3 or 4 finite numbers; hold instead.
    """
    wanted = np.asarray(action, np.float64)
    size = 4 if wanted.shape == (4,) else 3
    reason = unfit(wanted, size)
    if reason:
        raise ValueError(f"{reason}; hold instead of sending it")
    delta, touched = limits.step_m * wanted[:3], []
    for name, apply in _LIMITS.items():
        limited = apply(_Case(delta, snapshot, limits, motion))
        if np.abs(limited - delta).max() > _CHANGED_M:
            touched.append(name)
        delta = limited
    lever = np.clip(wanted[3:], -1.0, 1.0)
    executed = np.concatenate([delta / limits.step_m, lever])
    grip = _grip(float(lever[0])) if size == 4 else "keep"
    return Limited(snapshot.position + delta, grip, executed, tuple(touched))


def outside_m(position: Float[Tensor, " 3"], limits: Limits) -> float:
    """How far a position is outside the box, m; 0 inside."""
    beyond = position - np.clip(position, limits.box_low_m, limits.box_high_m)
    return float(np.linalg.norm(beyond))


def _grip(lever: float) -> Grip:
    if abs(lever) < GRIP_THRESHOLD:
        return "keep"
    return "open" if lever > 0 else "close"


def _unit(case: _Case) -> Vector:
    return np.clip(case.delta, -case.limits.step_m, case.limits.step_m)


def _step(case: _Case) -> Vector:
    return _shortened(case.delta, case.limits.step_m)


def _ramp(case: _Case) -> Vector:
    return _shortened(case.delta, _ramped_step_m(case))


def _force(case: _Case) -> Vector:
    """Beyond the force bound, the part of the delta that would press harder goes; retreat stays possible."""
    push = case.snapshot.force
    size = 0.0 if push is None else float(np.linalg.norm(push))
    if push is None or size <= case.limits.force_n:
        return case.delta
    outward = push / size
    return case.delta - min(float(case.delta @ outward), 0.0) * outward


def _speed(case: _Case) -> Vector:
    before = case.snapshot.position if case.motion.target is None else case.motion.target
    move = case.snapshot.position + case.delta - before
    longest = case.limits.speed_m_s * case.motion.elapsed_s
    return before + _shortened(move, longest) - case.snapshot.position


def _box(case: _Case) -> Vector:
    target = case.snapshot.position + case.delta
    return np.clip(target, case.limits.box_low_m, case.limits.box_high_m) - case.snapshot.position


def _lead(case: _Case) -> Vector:
    return _shortened(case.delta, min(_ramped_step_m(case), case.limits.reach_m))


def _ramped_step_m(case: _Case) -> float:
    period_s = 1.0 / case.limits.rate_hz
    grown = (case.motion.running_s + period_s) / max(case.limits.ramp_s, period_s)
    return case.limits.step_m * min(1.0, grown)


def _shortened(vector: Vector, longest: float) -> Vector:
    length = math.sqrt(float(vector @ vector))
    return vector if length <= longest else vector * (longest / length)


_LIMITS: Mapping[str, Callable[[_Case], Vector]] = {
    "unit": _unit,
    "step": _step,
    "ramp": _ramp,
    "force": _force,
    "speed": _speed,
    "box": _box,
    "lead": _lead,
}
