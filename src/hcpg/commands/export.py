"""`hcpg export`: a trained run as a folder that NumPy alone can run."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hcpg.commands import choice

DESCRIPTION = """Write a trained run's policy as a folder of numbers, facts and a model card, which a robot's
computer loads and runs with NumPy and safetensors, without JAX. It is loaded once to make sure of that."""


def run(arguments: Sequence[str]) -> int:
    """Write the folder; say where it is, how far it is from JAX, and what its digest is."""
    parser = argparse.ArgumentParser(prog="hcpg export", description=DESCRIPTION)
    choice.add_options(parser)
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="a new folder; default: in RUN/exports/")
    parser.add_argument(
        "--time", type=float, nargs="?", const=10.0, metavar="SECONDS", help="then act at 30 Hz for so long"
    )
    options = parser.parse_args(arguments)
    programs = choice.prepare()
    from hcpg.loops.control.deployed.timing import described, latency, measured
    from hcpg.loops.exporting import export
    from hcpg.safety.clock import MachineClock

    folder, policy = export(choice.load(options), options.out)
    lines = [str(folder), *described(policy)]
    if options.time is not None:
        lines += measured(latency(policy, options.time, MachineClock()))
    sys.stdout.writelines(f"{line}\n" for line in lines)
    if programs is not None:
        programs.close()
    return 0
