"""Memory handed back to the system: really, and not too often."""

import platform
from pathlib import Path

import numpy as np
import pytest

from hcpg.loops import memory

RESIDENT = Path("/proc/self/statm")


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc" or not RESIDENT.exists(), reason="glibc on Linux")
def test_what_is_freed_between_things_that_stay_goes_back_to_the_system():
    blocks = [np.ones(12_000) for _ in range(400)]  # 96 kB each: from the heap, not mapped one by one
    del blocks[::2], blocks[:-1]
    before = resident_bytes()
    memory.hand_back()
    assert before - resident_bytes() > 20e6


def resident_bytes():
    return int(RESIDENT.read_text().split()[1]) * 4096


def test_asked_again_within_the_pause_it_does_nothing(monkeypatch):
    done, now = [], [100.0]
    monkeypatch.setattr(memory, "hand_back", lambda: done.append(now[0]))
    monkeypatch.setattr(memory.time, "monotonic", lambda: now[0])
    returns = memory.Returns(10.0)
    for now[0] in (100.0, 101.0, 109.9, 110.0, 119.0, 125.0):
        returns.hand_back()
    assert done == [100.0, 110.0, 125.0]
