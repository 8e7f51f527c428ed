"""When to act: absolute deadlines on an injected clock, and how well they were kept."""

import math
from typing import NamedTuple

import numpy as np

from hcpg.interfaces import Clock

LONGEST_GAP = 3
MOST_SKIPPED_SHARE = 0.02
"""More ticks skipped in a row, or a larger share of an episode's ticks, and its timing does not count."""
_SAME_S = 1e-9


class Tick(NamedTuple):
    """One turn of the loop."""

    number: int
    """Skipped ticks have one too, so it is the time in periods."""
    due_s: float
    woke_s: float
    skipped: int
    """How many ticks before it were not executed."""


class Timing(NamedTuple):
    """How well an episode kept its deadlines."""

    ticks: int
    """Executed."""
    overruns: int
    """Ticks that were still busy, or still asleep, when the next one was due."""
    skipped: int
    """Deadlines that passed without a tick, because of these."""
    longest_gap: int
    """Most deadlines skipped in a row."""
    lateness_p50_ms: float
    lateness_p99_ms: float
    lateness_max_ms: float
    """Of waking up, against the deadline."""

    @property
    def sound(self) -> bool:
        """Whether the timing was good enough for the episode to count."""
        share = self.skipped / max(self.ticks + self.skipped, 1)
        return self.longest_gap <= LONGEST_GAP and share <= MOST_SKIPPED_SHARE


class Deadlines:
    """Tick n is due at t0 + n / rate, whatever happened before. A missed tick is never made up for.

    The first wait sets t0 and returns at once.
    """

    def __init__(self, clock: Clock, rate_hz: float) -> None:
        self._clock, self._period_s = clock, 1.0 / rate_hz
        self._start_s: float | None = None
        self._next = 0
        self._lateness_s: list[float] = []
        self._skipped, self._overruns, self._longest_gap = 0, 0, 0

    def wait(self) -> Tick:
        """Sleep until the next deadline that has not passed, and give its tick."""
        planned = self._next
        now_s = self._clock.now_s()
        if self._start_s is None:
            self._start_s = now_s
        number = max(planned, math.ceil((now_s - self._start_s - _SAME_S) / self._period_s))
        due_s = self._start_s + number * self._period_s
        self._clock.sleep_until(due_s)
        woke_s = self._clock.now_s()
        self._lateness_s.append(max(woke_s - due_s, 0.0))
        # Who sleeps through a whole period wakes up in a later tick.
        number = max(number, math.floor((woke_s - self._start_s + _SAME_S) / self._period_s))
        self._count(number - planned)
        self._next = number + 1
        return Tick(number, self._start_s + number * self._period_s, woke_s, number - planned)

    def timing(self) -> Timing:
        """What was counted so far; the lateness is NaN before the first tick."""
        late_ms = 1000 * np.asarray(self._lateness_s or [math.nan])
        p50, p99 = (float(np.percentile(late_ms, share)) for share in (50, 99))
        counts = (len(self._lateness_s), self._overruns, self._skipped, self._longest_gap)
        return Timing(*counts, p50, p99, float(late_ms.max()))

    def _count(self, skipped: int) -> None:
        self._overruns += skipped > 0
        self._skipped += skipped
        self._longest_gap = max(self._longest_gap, skipped)
