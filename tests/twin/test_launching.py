"""The start of a served twin: what is said while it lasts, and why it fails. No twin is needed for these."""

import os
import socket

import pytest

from hcpg.robot_types import RobotError
from hcpg.twin import launching
from hcpg.twin.channel import PORT
from hcpg.twin.launching import served

ADDRESS = f"127.{os.getpid() % 250 + 1}.{os.getpid() // 250 % 250 + 1}.251"


@pytest.fixture
def stands_in(monkeypatch, tmp_path):
    """A script in the place of the served twin."""
    program = tmp_path / "program"

    def write(script):
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setattr(launching, "PYTHON", program)
        monkeypatch.setattr(launching, "is_installed", lambda: True)

    return write


def test_a_twin_that_dies_is_noticed_with_its_last_words(stands_in, tmp_path):
    stands_in("echo no module named mujoco; exit 3")
    log = tmp_path / "log"
    log.write_text("of another twin\n")
    told = r"the twin at 127\S+ ended at its start, with 3; it said: no module named mujoco$"
    with pytest.raises(RobotError, match=told), served("button-press", ADDRESS, 0, log):
        pass
    assert log.read_text() == "of another twin\nno module named mujoco\n"


def test_a_slow_start_is_told_and_ends(stands_in, monkeypatch, tmp_path):
    stands_in("exec sleep 30")
    monkeypatch.setattr(launching, "STARTS_S", 0.4)
    monkeypatch.setattr(launching, "TOLD_EVERY_S", 0.1)
    lines = []
    with (
        pytest.raises(RobotError, match="did not start within 0 s; it said: nothing"),
        served("button-press", ADDRESS, 0, tmp_path / "log", lines.append),
    ):
        pass
    assert 1 <= len(lines) <= 4
    assert lines[0] == f"the twin at {ADDRESS} is starting, 0 s so far"


def test_an_address_that_is_taken_is_refused(stands_in, tmp_path):
    stands_in("exit 0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind((ADDRESS, PORT))
        with (
            pytest.raises(
                RobotError, match="Address already in use; end the twin that runs there, or choose"
            ),
            served("button-press", ADDRESS, 0, tmp_path / "log"),
        ):
            pass
    assert not (tmp_path / "log").exists()
