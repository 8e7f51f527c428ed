import numpy as np
import pytest

from hcpg.perception.calibrated import Calibrated
from hcpg.robot_types import RobotError
from hcpg.robots.point import PointArm

SNAPSHOT = PointArm().observe()


def test_positions_never_age(tmp_path):
    path = tmp_path / "places.json"
    path.write_text('{"hole": [0.45, 0.1, 0.02], "spare": [1, 2, 3]}')
    eyes = Calibrated.read(path, ("hole",))
    eyes.forget()
    sight = eyes.look(SNAPSHOT, 1e6)
    assert list(sight) == ["hole"]
    assert sight["hole"].position.tolist() == [0.45, 0.1, 0.02]
    assert 1e6 - sight["hole"].seen_s < 0 < eyes.age_limit_s


def test_what_is_missing_is_named_with_what_is_there(tmp_path):
    path = tmp_path / "places.json"
    path.write_text('{"hole": [0.45, 0.1, 0.02]}')
    with pytest.raises(RobotError, match="lacks the position of button; it has hole"):
        Calibrated.read(path, ("hole", "button"))


@pytest.mark.parametrize("position", [[0.1, 0.2], [0.1, 0.2, np.nan]])
def test_a_position_is_three_finite_numbers(position):
    with pytest.raises(RobotError, match="give three finite numbers"):
        Calibrated({"hole": np.array(position)})
