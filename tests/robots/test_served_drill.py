"""Faults of whole processes, against the served twin: killed and frozen for real.

Needs the twin's own environment: run `make twin` first.
"""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hcpg import cli
from hcpg.loops.control.drill import Site
from hcpg.loops.control.drill_processes import Controller, process_faults
from hcpg.twin.keeping import KeptTwin
from hcpg.twin.launching import is_installed

SOURCE = Path(__file__).parents[2] / "src"
ADDRESS = f"127.{os.getpid() % 250 + 1}.{os.getpid() // 250 % 250 + 1}.251"
needs_twin = pytest.mark.skipif(
    not is_installed() or importlib.util.find_spec("franky") is None,
    reason="the served twin's environment or the arm's driver is missing: run `make twin`",
)


@needs_twin
def test_a_controller_that_is_killed_and_one_that_comes_back(tmp_path):
    command = [sys.executable, "-m", "hcpg", "robot", "drill", "franka/button-press", "--robot", "twin"]
    faults = ["--fault", "server_restarted", "client_frozen_100_ms"]
    # In a process of its own: that one is frozen, and asks for real-time priority.
    done = subprocess.run(
        [*command, "--address", ADDRESS, "--serve", *faults, "--out", str(tmp_path / "drill")],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    outcomes = json.loads((tmp_path / "drill/outcomes.json").read_text())
    restarted, frozen = outcomes["server_restarted"], outcomes["client_frozen_100_ms"]
    assert restarted["endings"] == frozen["endings"] == ["fault", "time_limit"]
    assert restarted["cause"].startswith("no new state for 5")
    assert restarted["hold_after_ms"] < 150.0
    assert frozen["cause"] == "the robot's reflex"
    for outcome in (restarted, frozen):
        assert outcome["applied_while_wrong"] == 0
        assert outcome["logged"] == outcome["ticks"]
        assert outcome["furthest_outside_mm"] == 0.0


class Told:
    """A controller that says what was asked of it."""

    def __init__(self):
        self.asked = []

    def kill(self):
        self.asked.append("kill")

    def start_in(self, seconds):
        self.asked.append(("start", seconds))

    def freeze(self, seconds):
        self.asked.append(("freeze", seconds))


def test_each_fault_asks_the_controller_for_what_it_says():
    controller = Told()
    assert isinstance(controller, Controller)
    assert isinstance(KeptTwin("button-press", ADDRESS, 0, Path("unused")), Controller)
    faults = process_faults(controller)
    for name in ("server_killed", "server_restarted", "server_frozen_300_ms", "server_frozen_5_s"):
        faults[name].inject(object.__new__(Site))  # which these faults do not touch
    assert controller.asked == ["kill", "kill", ("start", 0.0), ("freeze", 0.3), ("freeze", 5.0)]


def test_serving_needs_an_address(capsys, tmp_path):
    words = ["robot", "drill", "franka/button-press", "--robot", "twin", "--serve", "--out", str(tmp_path)]
    assert cli.main(words) == 2
    assert "--serve needs the address to serve at: --address 127.0.0.1" in capsys.readouterr().err
