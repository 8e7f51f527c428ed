"""`--serve`: what cannot be served is refused before anything moves; what can, is served and ended."""

import pytest

from hcpg import cli
from hcpg.commands import served_twin

POINT = ["point/reach", "--robot", "point", "--serve"]
COMMANDS = {
    "check": [],
    "run": ["--out", "OUT"],
    "demos": ["--out", "OUT"],
    "trials": ["--unattended", "--policy", "chance=uniform", "--out", "OUT"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_an_arm_that_is_no_twin_cannot_be_served(capsys, tmp_path, command):
    words = [str(tmp_path / "out") if word == "OUT" else word for word in COMMANDS[command]]
    assert cli.main(["robot", command, *POINT, *words]) == 2
    assert (
        "--serve serves a twin: give a task of franka, --robot twin and --address" in capsys.readouterr().err
    )


def test_the_twin_is_there_while_the_command_runs(capsys, monkeypatch):
    """A stand-in for the server: which task, where, from which start states, and in what order."""
    events = []

    class Stand:
        def __init__(self, *where):
            self.where = where

        def __enter__(self):
            events.append(("up", *self.where[:3], self.where[3].name))
            self.where[4]("the twin is starting")

        def __exit__(self, *_):
            events.append(("down",))

    monkeypatch.setattr(served_twin, "served", Stand)
    command = [
        "robot",
        "check",
        "franka/button-press",
        "--robot",
        "twin",
        "--address",
        "192.0.2.1",
        "--serve",
    ]
    assert cli.main(command) == 2  # no loopback address, so the robot refuses, once its twin is up
    told = capsys.readouterr().err.splitlines()
    assert told[0] == "the twin is starting"
    assert "192.0.2.1 is no loopback address" in told[1]
    assert events == [("up", "button-press", "192.0.2.1", 1_000_000, "server.log"), ("down",)]
