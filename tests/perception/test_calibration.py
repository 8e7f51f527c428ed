import json

import numpy as np
import pytest

from hcpg.perception.calibration import read_calibration
from hcpg.robot_types import RobotError

STORED = {
    "camera_matrix": [[610, 0, 320], [0, 610, 240], [0, 0, 1]],
    "distortion": [0.1, -0.2, 0, 0, 0],
    "mount": "hand",
    "mount_from_camera": [[0, -1, 0, 0.05], [1, 0, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]],
    "tags": {"3": {"object": "drawer", "size_m": 0.04, "offset_m": [0, 0, -0.01]}},
}


def read(folder, **changes):
    path = folder / "camera.json"
    path.write_text(json.dumps({**STORED, **changes}))
    return read_calibration(path)


def test_what_is_stored_is_read(tmp_path):
    calibration = read(tmp_path)
    assert calibration.mount == "hand"
    assert calibration.mount_from_camera[:3, 3].tolist() == [0.05, 0, 0.1]
    assert calibration.camera_matrix[0, 0] == 610.0
    assert calibration.distortion.tolist() == [0.1, -0.2, 0, 0, 0]
    assert calibration.tags[3]._replace(offset_m=None) == ("drawer", 0.04, None)
    assert calibration.tags[3].offset_m.tolist() == [0, 0, -0.01]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"mount": "wall"}, "mount is 'wall'; it is 'base' or 'hand'"),
        ({"camera_matrix": [[610, 0], [0, 610]]}, r"camera_matrix has shape \(2, 2\)"),
        ({"mount_from_camera": np.diag([2, 1, 1, 1]).tolist()}, "no pose"),
        ({"mount_from_camera": np.diag([1, 1, -1, 1]).tolist()}, "no pose"),  # a mirror
        ({"tags": {"3": {"object": "drawer", "size_m": 40, "offset_m": [0, 0, 0]}}}, "in metres"),
        ({"tags": {"3": {"object": "drawer", "size_m": 0.04}}}, "give object, size_m"),
    ],
)
def test_what_cannot_be_is_named(tmp_path, changes, told):
    with pytest.raises(RobotError, match=told):
        read(tmp_path, **changes)


def test_missing_fields_are_named(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text('{"mount": "base"}')
    with pytest.raises(RobotError, match="lacks camera_matrix, distortion, mount_from_camera, tags"):
        read_calibration(path)
