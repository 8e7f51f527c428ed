"""Objects seen by a camera through the AprilTags on them; the finding goes on beside the control loop."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from hcpg.perception.calibration import Calibration
from hcpg.perception.tag_finding import TagFinder
from hcpg.robot_types import Sight, Sighting, Snapshot
from hcpg.safety.newest import Newest
from hcpg.types import Float, UInt8

REMEMBERED = 60
"""Snapshots kept to know where the hand was when a picture was taken: two seconds at 30 Hz."""
MOST_APART_S = 0.05
"""A picture without a snapshot within this time of it cannot be placed, if the camera is on the hand."""


class Picture(NamedTuple):
    """What a camera gives."""

    image: UInt8[np.ndarray, "..."]
    """[H, W] grey or [H, W, 3] in colour."""
    taken_s: float
    """On the robot's clock."""


class Found(NamedTuple):
    """What was in a picture."""

    taken_s: float
    places: Mapping[str, Float[np.ndarray, " 3"]]
    """Positions in the camera's frame, m, by object."""


class TagPerception:
    """Sightings from pictures; each is as old as its picture."""

    def __init__(
        self, take: Callable[[], Picture], calibration: Calibration, age_limit_s: float = 0.4
    ) -> None:
        """`take` waits for the camera's next picture; the first one is waited for here."""
        self.age_limit_s = age_limit_s
        self._take, self._finder, self._calibration = take, TagFinder(calibration), calibration
        self._image: np.ndarray | None = None
        self._last = Found(-np.inf, {})
        self._snapshots: deque[Snapshot] = deque(maxlen=REMEMBERED)
        self._sight: dict[str, Sighting] = {}
        self._since_s, self._used_s, self._forgets = -np.inf, -np.inf, False
        self._found = Newest(self._next, "tags")

    @property
    def error(self) -> Exception | None:
        """What ended the taking of pictures; sightings only grow older then. None while it goes on."""
        return self._found.error

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """The newest sightings, in the base frame."""
        self._snapshots.append(snapshot)
        if self._forgets:
            self._since_s, self._forgets = now_s, False
        found = self._found.value
        if found.taken_s > self._used_s and found.taken_s >= self._since_s:
            self._used_s = found.taken_s
            self._sight = {**self._sight, **self._placed(found)}
        return self._sight

    def forget(self) -> None:
        """Drop all sightings, and pictures taken before the next look."""
        self._sight, self._forgets = {}, True

    def close(self, timeout_s: float = 1.0) -> bool:
        """End the finding; gives whether the camera let it."""
        return self._found.close(timeout_s)

    def _next(self) -> Found:
        """What is in the next picture; one that equals the last to the bit is no news: the camera hangs."""
        picture = self._take()
        if self._image is None or not np.array_equal(picture.image, self._image):
            self._last = Found(picture.taken_s, self._finder.find(picture.image))
            self._image = picture.image
        return self._last

    def _placed(self, found: Found) -> dict[str, Sighting]:
        pose = self._mount_pose(found.taken_s)
        if pose is None:
            return {}
        rotation, position = pose
        camera = self._calibration.mount_from_camera
        placed = {}
        for name, place in found.places.items():
            on_mount = camera[:3, :3] @ place + camera[:3, 3]
            placed[name] = Sighting(rotation @ on_mount + position, found.taken_s)
        return placed

    def _mount_pose(self, time_s: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Rotation and position of what the camera sits on, when the picture was taken."""
        if self._calibration.mount == "base":
            return np.eye(3), np.zeros(3)
        nearest = min(self._snapshots, key=lambda each: abs(each.host_time_s - time_s))
        if abs(nearest.host_time_s - time_s) > MOST_APART_S:
            return None
        return _rotation(nearest.quaternion), nearest.position


def _rotation(quaternion: Float[np.ndarray, " 4"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of a unit quaternion (x, y, z, w)."""
    vector, scalar = np.asarray(quaternion[:3]), float(quaternion[3])
    cross = np.cross(np.eye(3), vector)
    return np.eye(3) + 2 * scalar * cross + 2 * cross @ cross
