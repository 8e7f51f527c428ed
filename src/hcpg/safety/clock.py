"""The clock of this machine, for robots that do not bring one."""

import time


class MachineClock:
    """Monotonic seconds; sleeping is left to the operating system."""

    def now_s(self) -> float:
        """Seconds of `time.perf_counter`."""
        return time.perf_counter()

    def sleep_until(self, time_s: float) -> None:
        """Sleep, and sleep again if woken early."""
        while (left_s := time_s - time.perf_counter()) > 0:
            time.sleep(left_s)
