"""Starts a served twin as a process of its own and ends it, for whoever needs one for a while."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from hcpg.robot_types import RobotError
from hcpg.twin.channel import Listener

ROOT = Path(__file__).parents[3]
PYTHON = ROOT / ".venv-twin/bin/python"
STARTS_S, ENDS_S = 30.0, 10.0


class Served(NamedTuple):
    """A served twin that runs."""

    address: str
    process: subprocess.Popen[bytes]
    log: Path


def is_installed() -> bool:
    """Whether `make twin` made the environment."""
    return (ROOT / ".venv-twin/installed").is_file()


@contextmanager
def served(task: str, address: str, seed: int, log: Path) -> Iterator[Served]:
    """A twin of the task, served at a loopback address from here to the end of the block.

    It runs before other programs where this user may ask for that (root): so does an arm's controller.

    Raises:
        RobotError: the environment is not there, or the twin did not start; the message says why.
    """
    if not is_installed():
        raise RobotError("the served twin's environment is missing; make it: make twin")
    command = [str(PYTHON), "-m", "hcpg.twin.serving", "--task", task, "--host", address, "--seed", str(seed)]
    command += ["--realtime"] * (os.geteuid() == 0)
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with log.open("ab") as out, subprocess.Popen(command, stdout=out, stderr=out, env=alone) as process:
        try:
            _wait(process, address, log)
            yield Served(address, process, log)
        finally:
            end(process)


def end(process: subprocess.Popen[bytes]) -> None:
    """End it, by force where it does not end by itself; safe to call twice."""
    process.send_signal(signal.SIGCONT)
    process.terminate()
    try:
        process.wait(ENDS_S)
    except subprocess.TimeoutExpired:
        process.kill()


def _wait(process: subprocess.Popen[bytes], address: str, log: Path) -> None:
    """Until it tells the truth on its third port."""
    listener, until_s = Listener(address), time.monotonic() + STARTS_S
    try:
        while not listener.surveyed() and not listener.moving():
            if process.poll() is not None or time.monotonic() > until_s:
                raise RobotError(f"the twin at {address} did not start; it said: {log.read_text()[-1000:]}")
            time.sleep(0.05)
    finally:
        listener.close()
