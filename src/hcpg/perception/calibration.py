"""What a camera file says: how the camera sees, where it sits, which tag is on which object."""

import json
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from hcpg.robot_types import RobotError
from hcpg.types import Float

Mount = Literal["base", "hand"]
_FIELDS = ("camera_matrix", "distortion", "mount", "mount_from_camera", "tags")
_ROTATION_TOLERANCE = 1e-3


class Tag(NamedTuple):
    """One AprilTag of the family 36h11."""

    object: str
    """The task's name of what it sticks on."""
    size_m: float
    """Side of the black square."""
    offset_m: Float[np.ndarray, " 3"]
    """From the tag's centre to the object's reference point, in the tag's frame: x right, y up, z out."""


class Calibration(NamedTuple):
    """A camera, and the tags it looks for."""

    camera_matrix: Float[np.ndarray, "3 3"]
    """Focal lengths and centre, pixels."""
    distortion: Float[np.ndarray, " D"]
    """OpenCV's coefficients k1, k2, p1, p2, k3, ..."""
    mount: Mount
    """`base`: fixed beside the arm. `hand`: moves with the TCP."""
    mount_from_camera: Float[np.ndarray, "4 4"]
    """Pose of the camera in the frame it is mounted to, m (the hand-eye calibration)."""
    tags: dict[int, Tag]
    """By number."""


def read_calibration(path: Path) -> Calibration:
    """The calibration in a JSON file; the fields are those of `Calibration`, tags as numbers in quotes.

    Raises:
        RobotError: a field is missing or cannot be what it says it is.
    """
    stored = json.loads(path.read_text())
    missing = [name for name in _FIELDS if name not in stored]
    if missing:
        raise RobotError(f"{path} lacks {', '.join(missing)}; it needs {', '.join(_FIELDS)}")
    if stored["mount"] not in ("base", "hand"):
        raise RobotError(f"{path}: mount is {stored['mount']!r}; it is 'base' or 'hand'")
    return Calibration(
        _numbers(path, stored, "camera_matrix", (3, 3)),
        np.asarray(stored["distortion"], np.float64),
        stored["mount"],
        _pose(path, stored),
        {int(number): _tag(path, number, tag) for number, tag in stored["tags"].items()},
    )


def _tag(path: Path, number: str, stored: dict[str, Any]) -> Tag:
    if set(stored) != {"object", "size_m", "offset_m"} or not 0.005 < stored["size_m"] < 0.5:
        raise RobotError(f"{path}: tag {number} is {stored}; give object, size_m (in metres) and offset_m")
    return Tag(stored["object"], stored["size_m"], _numbers(path, stored, "offset_m", (3,)))


def _pose(path: Path, stored: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    pose = _numbers(path, stored, "mount_from_camera", (4, 4))
    rotation = pose[:3, :3]
    twisted = np.abs(rotation @ rotation.T - np.eye(3)).max() > _ROTATION_TOLERANCE
    if twisted or np.linalg.det(rotation) < 0 or pose[3].tolist() != [0, 0, 0, 1]:
        raise RobotError(f"{path}: mount_from_camera is no pose (a rotation, a position in m, 0 0 0 1)")
    return pose


def _numbers(path: Path, stored: dict[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    numbers = np.asarray(stored[name], np.float64)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise RobotError(f"{path}: {name} has shape {numbers.shape}; give {shape} finite numbers")
    return numbers
