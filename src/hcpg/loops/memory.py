"""Memory that was freed, handed back to the system."""

import ctypes
import platform


def hand_back() -> None:
    """Let go of what the allocator keeps after large work. Without glibc: nothing."""
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)
