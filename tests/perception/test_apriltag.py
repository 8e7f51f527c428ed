"""The camera's thread and the placing; the pictures are rendered."""

import queue
import time

import numpy as np
import pytest
from rendered_tags import FACING, MATRIX, SIZE_M, picture
from scipy.spatial.transform import Rotation

from hcpg.perception.apriltag import Picture, TagPerception
from hcpg.perception.calibration import Calibration, Tag
from hcpg.robots.point import PointArm

AHEAD = np.array([0.05, -0.03, 0.5])
SEEN = picture({3: (AHEAD, FACING)})
SNAPSHOT = PointArm().observe()


class Camera:
    """Gives the pictures put into it, and lets a test wait until they are worked off."""

    def __init__(self, mount="base", pose=None, image=SEEN):
        self.pictures, self.asked = queue.Queue(), 0
        pose = np.eye(4) if pose is None else pose
        calibration = Calibration(MATRIX, np.zeros(5), mount, pose, {3: Tag("drawer", SIZE_M, np.zeros(3))})
        self.pictures.put(Picture(image, 0.0))
        self.eyes = TagPerception(self._take, calibration)

    def _take(self):
        self.asked += 1
        answer = self.pictures.get(timeout=10)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def show(self, image, taken_s):
        """A picture; returns when it was worked off, that is, when the next one is asked for."""
        before = self.asked
        self.pictures.put(Picture(image, taken_s))
        end_s = time.monotonic() + 10
        while self.asked == before and time.monotonic() < end_s:
            time.sleep(0.001)

    def close(self):
        self.pictures.put(ConnectionError("unplugged"))
        assert self.eyes.close(10.0)


@pytest.fixture
def camera():
    made = []

    def make(**parts):
        made.append(Camera(**parts))
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_a_fixed_camera_places_in_the_base_frame(camera):
    # The camera looks straight down from 0.8 m above the base's (0.4, 0.1).
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("x", 180, degrees=True).as_matrix()
    pose[:3, 3] = [0.4, 0.1, 0.8]
    sight = camera(pose=pose).eyes.look(SNAPSHOT, 0.2)
    assert sight["drawer"].position == pytest.approx([0.45, 0.13, 0.3], abs=0.002)
    assert sight["drawer"].seen_s == 0.0


def test_a_camera_on_the_hand_uses_the_pose_of_the_moment_of_the_picture(camera):
    pose = np.eye(4)
    pose[:3, 3] = [0.0, 0.0, 0.1]
    turned = Rotation.from_euler("z", 90, degrees=True).as_quat()
    there = SNAPSHOT._replace(quaternion=turned, position=np.array([0.5, 0.0, 0.2]), host_time_s=0.01)
    moved = there._replace(position=np.array([0.9, 0.9, 0.9]), host_time_s=0.3)
    watching = camera(mount="hand", pose=pose, image=np.full((480, 640), 9, np.uint8))
    watching.eyes.look(there, 0.01)
    watching.eyes.look(moved, 0.3)
    watching.show(SEEN, 0.02)
    sight = watching.eyes.look(moved._replace(host_time_s=0.4), 0.4)
    # Turned by 90 degrees about z, the camera's (0.05, -0.03) is the base's (0.03, 0.05).
    assert sight["drawer"].position == pytest.approx([0.53, 0.05, 0.2 + 0.1 + 0.5], abs=0.002)
    watching.show(picture({3: (AHEAD, FACING)}, seed=5), 0.15)  # no snapshot within 50 ms: cannot be placed
    assert watching.eyes.look(moved._replace(host_time_s=0.5), 0.5)["drawer"].seen_s == 0.02


def test_a_camera_that_hangs_gives_no_news(camera):
    watching = camera()
    watching.show(SEEN, 0.1)  # the same picture to the bit, with a new time
    assert watching.eyes.look(SNAPSHOT, 0.2)["drawer"].seen_s == 0.0
    watching.show(picture({3: (AHEAD, FACING)}, seed=1), 0.2)
    assert watching.eyes.look(SNAPSHOT, 0.3)["drawer"].seen_s == 0.2


def test_an_object_out_of_sight_keeps_its_last_sighting(camera):
    watching = camera()
    assert watching.eyes.look(SNAPSHOT, 0.1)["drawer"].seen_s == 0.0
    watching.show(np.full((480, 640), 120, np.uint8), 0.2)
    assert watching.eyes.look(SNAPSHOT, 0.3)["drawer"].seen_s == 0.0


def test_what_was_seen_before_the_scene_was_laid_out_does_not_count(camera):
    watching = camera()
    watching.eyes.forget()
    assert watching.eyes.look(SNAPSHOT, 1.0) == {}
    watching.show(picture({3: (AHEAD, FACING)}, seed=1), 0.9)
    assert watching.eyes.look(SNAPSHOT, 1.1) == {}
    watching.show(picture({3: (AHEAD, FACING)}, seed=2), 1.05)
    assert watching.eyes.look(SNAPSHOT, 1.2)["drawer"].seen_s == 1.05


def test_a_camera_that_breaks_leaves_the_last_sighting_and_says_why(camera):
    watching = camera()
    watching.close()
    assert watching.eyes.look(SNAPSHOT, 0.1)["drawer"].seen_s == 0.0
    assert str(watching.eyes.error) == "unplugged"
