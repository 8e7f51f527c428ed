"""Starts a served twin as a process of its own and ends it, for whoever needs one for a while."""

import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from hcpg.robot_types import RobotError
from hcpg.twin.channel import PORT, Listener

ROOT = Path(__file__).parents[3]
PYTHON = ROOT / ".venv-twin/bin/python"
STARTS_S, TOLD_EVERY_S, ENDS_S = 180.0, 5.0, 10.0
"""It starts within a second on an idle machine; on a full one, imports alone may take a minute."""
LAST = 1000
"""Characters of its output that an error tells."""
Tell = Callable[[str], None]


class Served(NamedTuple):
    """A served twin that runs."""

    address: str
    process: subprocess.Popen[bytes]
    log: Path


def is_installed() -> bool:
    """Whether `make twin` made the environment."""
    return (ROOT / ".venv-twin/installed").is_file()


@contextmanager
def served(task: str, address: str, seed: int, log: Path, tell: Tell = lambda _: None) -> Iterator[Served]:
    """A twin of the task, served at a loopback address from here to the end of the block.

    It runs before other programs where this user may ask for that (root): so does an arm's controller.
    `tell` is given a line every few seconds while it starts. A key that stops this program does not stop it:
    the arm has a controller until it has been let go of.

    Raises:
        RobotError: the environment is not there, the address is taken, or the twin did not start; the message
            says why.
    """
    if not is_installed():
        raise RobotError("the served twin's environment is missing; make it: make twin")
    _refuse_taken(address)
    command = [str(PYTHON), "-m", "hcpg.twin.serving", "--task", task, "--host", address, "--seed", str(seed)]
    command += ["--realtime"] * (os.geteuid() == 0)
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    before = log.stat().st_size if log.exists() else 0
    with (
        log.open("ab") as out,
        subprocess.Popen(command, stdout=out, stderr=out, env=alone, process_group=0) as process,
    ):
        try:
            running = Served(address, process, log)
            _wait(running, before, tell)
            yield running
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


def _wait(running: Served, before: int, tell: Tell) -> None:
    """Until it tells the truth on its third port; its output begins `before` bytes into the log."""
    listener, began_s, told_s = Listener(running.address), time.monotonic(), 0.0
    try:
        while not listener.surveyed() and not listener.moving():
            waited_s = time.monotonic() - began_s
            if running.process.poll() is not None or waited_s > STARTS_S:
                raise RobotError(_why(running, before, waited_s))
            if waited_s - told_s > TOLD_EVERY_S:
                told_s = waited_s
                tell(f"the twin at {running.address} is starting, {waited_s:.0f} s so far")
            time.sleep(0.05)
    finally:
        listener.close()


def _why(running: Served, before: int, waited_s: float) -> str:
    ended = running.process.poll()
    how = f"did not start within {waited_s:.0f} s" if ended is None else f"ended at its start, with {ended}"
    said = running.log.read_bytes()[before:].decode(errors="replace").strip()[-LAST:]
    return f"the twin at {running.address} {how}; it said: {said or 'nothing'}"


def _refuse_taken(address: str) -> None:
    """An older twin there would answer in the place of the new one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.bind((address, PORT))
        except OSError as error:
            cure = "end the twin that runs there, or choose another loopback address, such as 127.0.0.2"
            raise RobotError(f"no twin can be served at {address}: {error.strerror}; {cure}") from error
