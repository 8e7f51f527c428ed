"""The nouns of a robot: what it reports, what it is told, what it refuses, where objects are seen.

Positions are TCP positions in the arm's base frame, m; quaternions are (x, y, z, w); times are seconds on the
robot's own `clock` (`interfaces.Clock`), unless a name says "robot time", which is the controller's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

from hcpg.types import Float, Tensor

Mode = Literal["idle", "move", "guiding", "reflex", "user_stopped", "recovering", "disconnected", "other"]
"""What the controller does. `reflex`: it stopped itself; `user_stopped`: a person did, by the switch."""
Kind = Literal["twin", "real"]
"""What moves. A number made on a twin is never called real."""
Grip = Literal["keep", "open", "close"]
Refusal = Literal["", "epoch", "sequence", "stopped", "not_finite", "box", "lead", "reflex", "disconnected"]
"""Why a robot did not carry out a command; "" where it did."""


class RobotError(RuntimeError):
    """A robot that cannot be used as asked; the message names the cause and the cure."""


@dataclass(frozen=True)
class Limits:
    """What the arm may do; always on. A robot's file sets its own, and they are shown at start."""

    box_low_m: tuple[float, float, float]
    """Lowest corner of the box that no target may leave, base frame."""
    box_high_m: tuple[float, float, float]
    outside_m: float = 0.02
    """Measured further outside the box than this, the episode ends."""
    rate_hz: float = 30.0
    """Commands per second."""
    step_m: float = 0.010
    """What 1 in an action means, and the longest step whatever its direction."""
    speed_m_s: float = 0.45
    """Fastest that the target itself may move, from one command to the next."""
    lead_m: float = 0.020
    """Furthest that the target may be ahead of the measured position."""
    stiffness_n_m: float = 2000.0
    """Of the impedance that pulls the TCP to its target; lead times stiffness is the force asked for."""
    force_n: float = 30.0
    """Bound of that force, and of the measured one: beyond it, no step goes further into the contact."""
    ramp_s: float = 0.2
    """After every hold, steps grow from nothing to their full length within this time."""
    stale_hold_s: float = 0.05
    """A state older than this: hold."""
    stale_end_s: float = 0.5
    """A state older than this: the episode ends."""
    blind_hold_s: float = 0.5
    """A sighting older than perception allows: hold for so long, then go on without the selector (K = 1)."""
    gripper_refusals: int = 3
    """How many gripper commands may fail in an episode before it ends."""
    recoveries: int = 3
    """How many reflexes in a row are cleared before a person has to look."""

    def __post_init__(self) -> None:
        """Refuse limits that limit nothing.

        Raises:
            ValueError: a box without volume, or a number that is not finite and above 0.
        """
        if not all(low < high for low, high in zip(self.box_low_m, self.box_high_m, strict=True)):
            raise ValueError(f"the box {self.box_low_m} to {self.box_high_m} has no volume; mend its corners")
        for field in fields(self)[2:]:
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{field.name} is {value!r}; it must be finite and above 0")
        if self.stale_end_s <= self.stale_hold_s:
            raise ValueError(f"stale_end_s {self.stale_end_s} must exceed stale_hold_s {self.stale_hold_s}")

    @property
    def reach_m(self) -> float:
        """How far ahead of the measured position a target may be: the lead, or what the force allows."""
        return min(self.lead_m, self.force_n / self.stiffness_n_m)


class Snapshot(NamedTuple):
    """The robot's newest known state. It is never changed after it was made, so any thread may read it."""

    sequence: int
    """Counts state updates; two reads with one number are the same state."""
    epoch: int
    """Counts connects, resets, reflexes, recoveries and stops; a command of another epoch is refused."""
    robot_time_s: float
    """The controller's own time of this state."""
    host_time_s: float
    """When it arrived here; the age of the state is the clock's now minus this."""
    position: Float[Tensor, " 3"]
    velocity: Float[Tensor, " 3"]
    """Of the TCP, m/s."""
    quaternion: Float[Tensor, " 4"]
    joint_angles: Float[Tensor, " J"]
    """rad; 7 for a Franka."""
    force: Float[Tensor, " 3"] | None
    """What the surroundings push on the TCP with, N, in the base frame; None where nothing estimates it."""
    gripper_width_m: float
    gripper_time_s: float
    """When the width was read; a gripper answers much slower than the arm."""
    gripper_refusals: int
    """How many gripper commands failed or were refused since the connect."""
    mode: Mode
    success_rate: float
    """Share in [0, 1] of the last commands that reached the controller in time; 1 if none can be lost."""


class Command(NamedTuple):
    """One target, already within the limits, and what it answers."""

    sequence: int
    """Strictly increasing over the life of a connection; a number seen before is refused."""
    epoch: int
    """That of the snapshot it was computed from."""
    position: Float[Tensor, " 3"]
    """Where the TCP shall be, m. The orientation is the robot's fixed nominal one."""
    grip: Grip
    """Said at every tick; the same word again changes nothing."""


class Ack(NamedTuple):
    """What became of a command."""

    applied: bool
    refusal: Refusal


class Recovery(NamedTuple):
    """What became of an attempt to clear a reflex."""

    recovered: bool
    reconnect: bool
    """True where the connection itself is gone, so that clearing errors cannot help."""
    reason: str


class Check(NamedTuple):
    """One thing looked at before the arm may move."""

    name: str
    passed: bool
    found: str
    """What was measured, with its unit."""
    cure: str
    """What to do where it did not pass."""


class Info(NamedTuple):
    """Who answered a connect, and what was checked before motion."""

    name: str
    kind: Kind
    versions: Mapping[str, str]
    """Of client, server and controller, by name."""
    checks: tuple[Check, ...]


class Sighting(NamedTuple):
    """Where an object was seen, and when."""

    position: Float[Tensor, " 3"]
    seen_s: float
    """When the picture behind it was taken, on the robot's clock; `inf` for a pose that never ages."""


Sight = Mapping[str, Sighting]
"""The newest sighting of every object ever seen, by the task's name of it."""
