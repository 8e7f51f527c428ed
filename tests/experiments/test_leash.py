"""What is left of a training whose starter is killed without a word."""

import subprocess
import sys
import time

from tiny_cells import await_rows, cell

from hcpg.experiments.ledger import entries
from hcpg.experiments.units import command, units

STARTER = """
import sys, time
from pathlib import Path
from hcpg.experiments.local import training
from hcpg.experiments.slots import Slot
training(sys.argv[2:], Path(sys.argv[1]), Slot("any", frozenset(), {}), keep=[], leash=True)
time.sleep(600)
"""


def test_a_training_on_a_leash_saves_and_ends_when_its_starter_is_killed(tmp_path):
    [unit] = units(entries([cell(0, steps=40_000, evaluations=1)], tmp_path), together=False)
    words = command(unit, tmp_path)
    starter = subprocess.Popen([sys.executable, "-c", STARTER, tmp_path / "log.txt", *words])
    training = await_rows(tmp_path)
    starter.kill()
    starter.wait()
    while training.in_use():
        time.sleep(0.05)
    assert training.status()["state"] == "stopped"
    assert 0 < training.status()["step"] < 40_000
    assert len(list(training.checkpoints.glob("step_*"))) == 1
