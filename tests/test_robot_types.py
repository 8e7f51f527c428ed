import math
from dataclasses import replace

import pytest

from hcpg.robot_types import Limits

LIMITS = Limits(box_low_m=(0.0, 0.0, 0.0), box_high_m=(1.0, 1.0, 1.0))


def test_the_reach_is_the_lead_or_what_the_force_allows():
    assert LIMITS.reach_m == 0.015  # 30 N at 2000 N/m
    assert replace(LIMITS, stiffness_n_m=500.0).reach_m == LIMITS.lead_m == 0.02


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"box_high_m": (1.0, 0.0, 1.0)}, "has no volume"),
        ({"step_m": 0.0}, "step_m is 0.0; it must be finite and above 0"),
        ({"force_n": math.inf}, "force_n is inf"),
        ({"speed_m_s": math.nan}, "speed_m_s is nan"),
        ({"recoveries": -1}, "recoveries is -1"),
        ({"stale_end_s": 0.05}, "must exceed stale_hold_s"),
    ],
)
def test_limits_that_limit_nothing_are_refused(change, told):
    with pytest.raises(ValueError, match=told):
        replace(LIMITS, **change)
