import pytest

from hcpg.loops.control.deadlines import Deadlines, Timing
from hcpg.robots.point import JumpingClock


class SlowClock(JumpingClock):
    """Wakes up late by what `late_s` says."""

    late_s = 0.0

    def sleep_until(self, time_s):
        super().sleep_until(time_s + self.late_s)


def test_deadlines_are_absolute():
    clock = JumpingClock()
    deadlines = Deadlines(clock, 10.0)
    for number in range(5):
        tick = deadlines.wait()
        assert (tick.number, tick.skipped) == (number, 0)
        assert tick.due_s == tick.woke_s == pytest.approx(0.1 * number)
        clock.sleep_until(clock.now_s() + 0.03 * number)  # bodies of any length move nothing
    assert deadlines.timing() == Timing(5, 0, 0, 0, 0.0, 0.0, 0.0)


def test_the_first_tick_is_never_missed():
    clock = JumpingClock()
    deadlines = Deadlines(clock, 10.0)
    clock.sleep_until(7.3)  # set-up that takes its time
    assert deadlines.wait() == (0, 7.3, 7.3, 0)
    assert deadlines.wait().due_s == pytest.approx(7.4)


def test_a_missed_deadline_is_skipped_never_made_up_for():
    clock = JumpingClock()
    deadlines = Deadlines(clock, 10.0)
    deadlines.wait()
    clock.sleep_until(0.57)  # busy until after the deadlines of the ticks 1 to 5
    tick = deadlines.wait()
    assert (tick.number, tick.skipped, tick.due_s) == (6, 5, pytest.approx(0.6))
    assert deadlines.wait().number == 7
    timing = deadlines.timing()
    assert (timing.ticks, timing.overruns, timing.skipped, timing.longest_gap) == (3, 1, 5, 5)
    assert not timing.sound  # more than three in a row


def test_a_body_that_ends_at_its_deadline_is_in_time():
    clock = JumpingClock()
    deadlines = Deadlines(clock, 10.0)
    deadlines.wait()
    clock.sleep_until(0.1)
    assert deadlines.wait()[:3] == (1, pytest.approx(0.1), pytest.approx(0.1))


def test_lateness_is_that_of_waking_up():
    clock = SlowClock()
    deadlines = Deadlines(clock, 10.0)
    for late_s in (0.001, 0.002, 0.003, 0.02):
        clock.late_s = late_s
        deadlines.wait()
    timing = deadlines.timing()
    assert (timing.lateness_p50_ms, timing.lateness_max_ms) == (pytest.approx(2.5), pytest.approx(20.0))
    assert timing.lateness_p99_ms == pytest.approx(3 + 0.97 * 17)  # linear between the third and the fourth
    assert timing.sound


def test_who_sleeps_through_a_period_wakes_up_in_a_later_tick():
    clock = SlowClock()
    deadlines = Deadlines(clock, 10.0)
    clock.late_s = 0.25
    tick = deadlines.wait()
    assert (tick.number, tick.skipped, tick.woke_s) == (2, 2, pytest.approx(0.25))
    assert deadlines.timing().lateness_max_ms == pytest.approx(250.0)


@pytest.mark.parametrize(("ticks", "skipped", "sound"), [(98, 2, True), (97, 3, False)])
def test_two_percent_may_be_skipped(ticks, skipped, sound):
    assert Timing(ticks, skipped, skipped, 1, 0.0, 0.0, 0.0).sound is sound


def test_deadlines_do_not_drift():
    clock = JumpingClock()
    deadlines = Deadlines(clock, 30.0)
    for _ in range(900):
        tick = deadlines.wait()
    assert (tick.number, tick.due_s) == (899, pytest.approx(899 / 30, abs=1e-12))
