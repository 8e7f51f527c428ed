from itertools import pairwise

import numpy as np
import pytest

from hcpg.perception.truth import NoisyTruth, Poorness
from hcpg.robots.point import PointArm

SNAPSHOT = PointArm().observe()
TICKS = np.arange(3000) / 30


class Ball:
    """Moves along x at 1 m/s; its position is the time."""

    now_s = 0.0

    def read(self):
        return {"ball": np.array([self.now_s, 0.0, 0.0])}


def watched(seed=0, **poorness):
    """What was seen at each tick of 100 s, or None."""
    ball, seen = Ball(), []
    eyes = NoisyTruth(ball.read, Poorness(**poorness), seed)
    for now_s in TICKS:
        ball.now_s = float(now_s)
        seen.append(eyes.look(SNAPSHOT, float(now_s)).get("ball"))
    return seen


def test_pictures_come_at_their_rate_and_late():
    seen = watched(noise_m=(0.0, 0.0, 0.0), dropouts=0.0)
    assert seen[:3] == [None, None, None]  # the first picture is answered after 100 ms
    # At 30 ticks and 10 pictures a second, each picture is the newest for three ticks.
    for tick in range(3, 60):
        taken_s = (tick - 3) // 3 * 0.1
        assert seen[tick].seen_s == pytest.approx(taken_s)
        assert seen[tick].position[0] == pytest.approx(taken_s)  # where it was then, not where it is now


def test_the_noise_is_the_one_asked_for():
    seen = watched(noise_m=(0.001, 0.002, 0.003), dropouts=0.0)[3:]
    errors = np.array([each.position - [each.seen_s, 0, 0] for each in seen[::3]])
    # 999 pictures: the standard deviation is known to 1 / sqrt(2 * 999) = 2.2 %.
    assert errors.std(axis=0) == pytest.approx([0.001, 0.002, 0.003], rel=0.08)
    assert np.abs(errors.mean(axis=0)).max() < 0.0003


def test_dropouts_leave_the_older_sighting():
    seen = [each for each in watched(dropouts=0.3) if each is not None]
    different = len({each.seen_s for each in seen})
    assert different == pytest.approx(0.7 * 1000, abs=60)  # 4 standard deviations of 14.5
    assert all(later.seen_s >= earlier.seen_s for earlier, later in pairwise(seen))


def test_a_seed_names_the_noise():
    first, again, other = (watched(seed=seed)[100].position.tolist() for seed in (1, 1, 2))
    assert first == again != other


def test_forgetting_drops_what_is_not_answered_yet():
    ball = Ball()
    eyes = NoisyTruth(ball.read, Poorness(dropouts=0.0), 0)
    eyes.look(SNAPSHOT, 0.0)
    eyes.forget()
    assert eyes.look(SNAPSHOT, 0.09) == {}
    assert eyes.look(SNAPSHOT, 0.12) == {}
    assert eyes.look(SNAPSHOT, 0.23)["ball"].seen_s == 0.12
