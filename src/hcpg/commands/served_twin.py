"""`--serve`: a twin that is served at an address for as long as the command runs."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hcpg.robot_types import RobotError
from hcpg.robots.twin import START_SEED
from hcpg.twin.launching import served

LOG = "server.log"


def add_serve(parser: argparse.ArgumentParser) -> None:
    """Declare the option."""
    parser.add_argument(
        "--serve", action="store_true", help="serve the twin at ADDRESS while the command runs"
    )


@contextmanager
def serving(options: argparse.Namespace, folder: Path) -> Iterator[None]:
    """The twin of the task, if it is to be served from here; its output is appended to a log in `folder`.

    Raises:
        RobotError: the options name no twin that could be served, or it did not start.
    """
    if not options.serve:
        yield
        return
    suite, _, name = options.task.partition("/")
    if suite != "franka" or options.robot != "twin" or options.address is None:
        raise RobotError("--serve serves a twin: give a task of franka, --robot twin and --address 127.0.0.1")
    folder.mkdir(parents=True, exist_ok=True)
    with served(name, options.address, START_SEED, folder / LOG, _tell):
        yield


def _tell(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
