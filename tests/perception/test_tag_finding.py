import sys

import cv2
import numpy as np
import pytest
from rendered_tags import FACING, MATRIX, SIZE_M, picture, poses

from hcpg.perception.calibration import Calibration, Tag
from hcpg.perception.tag_finding import TagFinder
from hcpg.robot_types import RobotError


def calibration(**tags):
    named = {int(name[1:]): tag for name, tag in tags.items()}
    return Calibration(MATRIX, np.zeros(5), "base", np.eye(4), named)


def tag(name="drawer", offset_m=(0.0, 0.0, 0.0)):
    return Tag(name, SIZE_M, np.asarray(offset_m))


def errors_mm(finder, seed):
    placed = []
    for number, (position, rotation) in enumerate(poses(6, seed)):
        found = finder.find(picture({3: (position, rotation)}, seed=number))
        placed.append(1000 * np.abs(found["drawer"] - position))
    return np.median(placed, axis=0)


def test_positions_in_blurred_noisy_pictures():
    refined = TagFinder(calibration(t3=tag()))
    across, down, depth = errors_mm(refined, seed=1)
    assert max(across, down) < 0.2
    assert depth < 1.5
    coarse = TagFinder(calibration(t3=tag()))
    coarse._detector = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), cv2.aruco.DetectorParameters()
    )
    assert errors_mm(coarse, seed=1)[2] > 3 * depth


def test_the_offset_is_in_the_tags_frame():
    # The tag faces the camera: its z (towards the camera) is the camera's -z, its y the camera's -y.
    finder = TagFinder(calibration(t3=tag(offset_m=(0.01, 0.02, 0.03))))
    found = finder.find(picture({3: (np.array([0.0, 0.0, 0.5]), FACING)}))
    assert found["drawer"] == pytest.approx([0.01, -0.02, 0.47], abs=0.006)


def test_only_the_calibrations_tags_are_told_each_by_its_object():
    places = {3: (np.array([-0.1, 0, 0.5]), FACING), 8: (np.array([0.1, 0, 0.6]), FACING)}
    image = picture({**places, 5: (np.array([0.0, 0.1, 0.5]), FACING)})
    found = TagFinder(calibration(t3=tag("drawer"), t8=tag("button"), t9=tag("ball"))).find(image)
    assert sorted(found) == ["button", "drawer"]
    assert found["button"] == pytest.approx([0.1, 0, 0.6], abs=0.006)


def test_a_tag_that_left_its_crop_is_found_in_the_whole_picture():
    finder = TagFinder(calibration(t3=tag()))
    here, there = np.array([-0.12, -0.05, 0.6]), np.array([0.12, 0.08, 0.6])
    first = finder.find(picture({3: (here, FACING)}))
    # 40 mm at 0.6 m are 40.7 pixels, and as much again on every side.
    extent = [each.stop - each.start for each in finder._crop]
    assert extent == pytest.approx([122, 122], abs=3)
    again = finder.find(picture({3: (here, FACING)}, seed=1))
    moved = finder.find(picture({3: (there, FACING)}, seed=2))
    assert again["drawer"] == pytest.approx(first["drawer"], abs=0.006)
    assert moved["drawer"] == pytest.approx(there, abs=0.006)


def test_colour_pictures_are_read_too():
    image = picture({3: (np.array([0.0, 0.0, 0.5]), FACING)})
    found = TagFinder(calibration(t3=tag())).find(np.repeat(image[..., None], 3, axis=2))
    assert found["drawer"] == pytest.approx([0, 0, 0.5], abs=0.006)


def test_an_empty_picture_has_nothing():
    assert TagFinder(calibration(t3=tag())).find(np.full((480, 640), 120, np.uint8)) == {}


def test_without_opencv_the_cure_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(RobotError, match=r"pip install 'hcpg-flow\[tags\]'"):
        TagFinder(calibration(t3=tag()))
