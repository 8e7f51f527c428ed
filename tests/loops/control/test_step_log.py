import errno
import json
from typing import NamedTuple

import numpy as np
import pytest

from hcpg.loops.control.step_log import MOST_WAITING, RESERVE_BYTES, LogError, StepLog, plain
from hcpg.robot_types import Limits


class Disk:
    """Takes `room` bytes, and those of the reserve once it was given back."""

    def __init__(self, path, room, error=errno.ENOSPC):
        self.path, self.room, self.error = path, room, error
        self.file = path.open("ab", buffering=0)

    def write(self, content):
        reserve = self.path.with_name(f".{self.path.name}.reserve")
        left = self.room + (0 if reserve.exists() else RESERVE_BYTES) - self.path.stat().st_size
        if left <= 0:
            raise OSError(self.error, "No space left on device")
        return self.file.write(content[:left])

    def close(self):
        self.file.close()


def numbers(path):
    return [json.loads(line)["number"] for line in path.read_text().splitlines()]


def test_rows_are_one_line_each(tmp_path):
    log = StepLog(tmp_path / "steps.jsonl", threaded=False)
    log.put({"number": 1, "position": np.array([0.5, np.nan])})
    assert (tmp_path / "steps.jsonl").read_text() == '{"number":1,"position":[0.5,null]}\n'
    log.close()
    log.close()
    assert [path.name for path in tmp_path.iterdir()] == ["steps.jsonl"]


def test_a_thread_writes_all_before_the_close_returns(tmp_path):
    log = StepLog(tmp_path / "steps.jsonl")
    for number in range(200):
        log.put({"number": number})
    log.close()
    assert numbers(log.path) == list(range(200))
    assert log.failure == ""


def test_a_full_disk_is_told_and_loses_and_doubles_nothing(tmp_path):
    # 25 bytes end within the third row of 13 bytes, so the write is torn and taken up at the byte.
    log = StepLog(tmp_path / "steps.jsonl", lambda path: Disk(path, room=30), threaded=False)
    for number in range(2):
        log.put({"number": number})
    assert log.failure == ""
    for number in range(2, 9):
        log.put({"number": number})
    assert log.failure == "cannot write steps.jsonl: No space left on device"
    log.close()
    assert numbers(log.path) == list(range(9))


def test_steps_that_fit_nowhere_are_counted(tmp_path):
    log = StepLog(tmp_path / "steps.jsonl", lambda path: Disk(path, room=-RESERVE_BYTES), threaded=False)
    for number in range(3):
        log.put({"number": number})
    with pytest.raises(LogError, match=r"^3 steps are not in .*No space left on device"):
        log.close()


def test_another_error_of_the_disk_keeps_the_reserve(tmp_path):
    log = StepLog(tmp_path / "steps.jsonl", lambda path: Disk(path, 0, errno.EIO), threaded=False)
    log.put({"number": 0})
    assert log.failure != ""
    assert (tmp_path / ".steps.jsonl.reserve").stat().st_size == RESERVE_BYTES
    with pytest.raises(LogError, match="1 steps"):
        log.close()


def test_a_disk_that_hangs_is_told_before_memory_fills(tmp_path):
    log = StepLog(tmp_path / "steps.jsonl")
    with log._writing:  # the disk takes nothing
        for number in range(MOST_WAITING + 2):
            log.put({"number": number})
        assert "it is too slow" in log.failure
    log.close()
    assert numbers(log.path) == list(range(MOST_WAITING + 2))


def test_without_room_for_the_reserve_nothing_begins(tmp_path, monkeypatch):
    def no_room(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", no_room)
    with pytest.raises(LogError, match="no room for the log"):
        StepLog(tmp_path / "steps.jsonl")
    assert list(tmp_path.iterdir()) == []


class Pair(NamedTuple):
    left: float
    right: tuple


def test_everything_has_a_word_in_json():
    value = {"pair": Pair(float("inf"), (np.float32(0.5), None)), "flag": np.bool_(True), "odd": {1}}
    assert plain(value) == {"pair": {"left": None, "right": [0.5, None]}, "flag": True, "odd": "{1}"}
    assert plain(np.array([None, "x"])) == [None, "x"]
    assert plain(Limits((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))["step_m"] == 0.01
