"""The options that `evaluate` and `play` share: which run, and how it shall act."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from hcpg.loops import machine
from hcpg.loops.compiled_programs import CompiledPrograms, open_programs

if TYPE_CHECKING:
    from hcpg.loops.trained import Trained


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare them."""
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder, or one of its checkpoints")
    parser.add_argument("--selector", help="a rule (`hcpg list selectors`) or `bare`; default: the run's own")
    parser.add_argument(
        "--candidates", type=int, help="proposals per action (K); default: the run's own, or 4"
    )
    parser.add_argument("--adapter", help="scene reader; default: the run's own")
    parser.add_argument("--checkpoint", type=int, metavar="STEP", help="default: the newest")


def prepare() -> CompiledPrograms | None:
    """Set this process up as training was, before JAX is imported: a run then acts bit for bit alike."""
    if not machine.has_accelerator():
        os.environ.update(machine.one_core(os.environ))
    return open_programs(os.environ)


def load(options: argparse.Namespace) -> "Trained":
    """The run that the options name."""
    from hcpg.loops.trained import Choice, load

    choice = Choice(options.selector, options.candidates, options.adapter, options.checkpoint)
    return load(options.run, choice)
