"""AprilTags in a picture, and where the objects they stick on are, seen from the camera.

The corners are refined by the AprilTag library's own method: without it the depth is several times
worse (the tests compare both). It costs tens of milliseconds in a whole picture, hence the crop.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hcpg.perception.calibration import Calibration, Tag
from hcpg.robot_types import RobotError
from hcpg.types import Float, UInt8

_WHOLE = (slice(None), slice(None))
MARGIN = 1.0
"""The next picture is searched around the tags of this one, their own extent further on every side."""
_UNIT_SQUARE = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])


class TagFinder:
    """Looks for the calibration's tags, first where they were."""

    def __init__(self, calibration: Calibration) -> None:
        """Set OpenCV up.

        Raises:
            RobotError: OpenCV is not installed.
        """
        self._cv2 = _opencv()
        self._calibration = calibration
        aruco = self._cv2.aruco
        parameters = aruco.DetectorParameters()
        parameters.cornerRefinementMethod = aruco.CORNER_REFINE_APRILTAG
        family = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
        self._detector = aruco.ArucoDetector(family, parameters)
        self._crop: tuple[slice, slice] | None = None

    def find(self, image: UInt8[np.ndarray, "..."]) -> Mapping[str, Float[np.ndarray, " 3"]]:
        """Positions of the objects whose tags were found, m, in the camera's frame: x right, y down, z ahead.

        `image` is [H, W] grey or [H, W, 3] in colour.
        """
        grey = image if image.ndim == 2 else self._cv2.cvtColor(image, self._cv2.COLOR_RGB2GRAY)
        corners = self._corners(grey)
        self._crop = _around(corners, grey.shape) if corners else None
        tags = self._calibration.tags
        return {tags[number].object: self._place(tags[number], pixels) for number, pixels in corners.items()}

    def _corners(self, grey: UInt8[np.ndarray, "H W"]) -> dict[int, Float[np.ndarray, "4 2"]]:
        """Of every known tag, clockwise from its top left; in the crop, or in the whole picture."""
        if self._crop is not None:
            found = self._detect(grey, self._crop)
            if len(found) == len(self._calibration.tags):
                return found
        return self._detect(grey, _WHOLE)

    def _detect(
        self, grey: UInt8[np.ndarray, "H W"], crop: tuple[slice, slice]
    ) -> dict[int, Float[np.ndarray, "4 2"]]:
        quads, numbers, _ = self._detector.detectMarkers(np.ascontiguousarray(grey[crop]))
        # This refinement counts from a pixel's corner, camera matrices count from its centre.
        origin = np.array([crop[1].start or 0, crop[0].start or 0], np.float64) - 0.5
        named = zip([] if numbers is None else numbers.ravel().tolist(), quads, strict=True)
        tags = self._calibration.tags
        return {number: quad.reshape(4, 2) + origin for number, quad in named if number in tags}

    def _place(self, tag: Tag, pixels: Float[np.ndarray, "4 2"]) -> Float[np.ndarray, " 3"]:
        cv2, calibration = self._cv2, self._calibration
        _, turn, shift = cv2.solvePnP(
            tag.size_m * _UNIT_SQUARE,
            pixels,
            calibration.camera_matrix,
            calibration.distortion,
            flags=cv2.SOLVEPNP_IPPE_SQUARE,
        )
        rotation, _ = cv2.Rodrigues(turn)
        return rotation @ tag.offset_m + shift.ravel()


def _around(corners: dict[int, np.ndarray], shape: tuple[int, ...]) -> tuple[slice, slice]:
    points = np.concatenate(list(corners.values()))
    low, high = points.min(axis=0), points.max(axis=0)
    extent = np.max([each.max(axis=0) - each.min(axis=0) for each in corners.values()], axis=0)
    left, top = np.floor(np.maximum(low - MARGIN * extent, 0)).astype(int)
    right, bottom = np.ceil(high + MARGIN * extent).astype(int)
    return slice(int(top), min(int(bottom), shape[0])), slice(int(left), min(int(right), shape[1]))


def _opencv() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise RobotError("AprilTags need OpenCV: pip install 'hcpg-flow[tags]'") from error
    return cv2
