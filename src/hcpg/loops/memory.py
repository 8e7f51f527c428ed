"""Memory that was freed, handed back to the system."""

import ctypes
import platform
import time


def hand_back() -> None:
    """Let go of what the allocator keeps after large work. Without glibc: nothing."""
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)


class Returns:
    """Hands memory back when asked, but not again within `pause_s`: once takes as long as half a tick."""

    def __init__(self, pause_s: float) -> None:
        self._pause_s, self._due = pause_s, 0.0

    def hand_back(self) -> None:
        """Do it if it is due."""
        if time.monotonic() >= self._due:
            hand_back()
            self._due = time.monotonic() + self._pause_s
