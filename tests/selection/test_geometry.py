"""Points and directions: by hand, and rotations against SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hcpg.selection import geometry


def test_rotation_agrees_with_scipy():
    turns = Rotation.random(20, rng=0)
    expected = turns.apply([-0.13, 0.02, -0.01])
    assert geometry.rotated(turns.as_quat(), (-0.13, 0.02, -0.01)) == pytest.approx(expected, abs=1e-12)


def test_a_funnel_is_entered_from_above_and_left_downwards():
    tools, target = np.array([[0.3, 0.04, 0.1], [0.3, 0.02, 0.1]]), np.array([[0.3, 0.0, 0.05]] * 2)
    assert geometry.planar_distance(tools, target) == pytest.approx([0.04, 0.02])
    aims = geometry.funnel(tools, target, radius_m=0.03, height_m=0.2)
    assert aims == pytest.approx(np.array([[0.3, 0.0, 0.25], [0.3, 0.0, 0.05]]))
