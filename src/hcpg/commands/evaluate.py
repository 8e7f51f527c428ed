"""`hcpg evaluate`: success rates of a trained run, on the evaluation's fixed start states."""

import argparse
import sys
from collections.abc import Sequence

from hcpg.commands import choice
from hcpg.loops import machine

DESCRIPTION = """Evaluate a trained run or checkpoint with any selector, beside the bare actor. Every
episode's row goes into RUN/evaluations/; the run's own tables stay as they are."""


def run(arguments: Sequence[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="hcpg evaluate", description=DESCRIPTION)
    choice.add_options(parser)
    parser.add_argument("--episodes", type=_positive, default=50, help="one start state each; default: 50")
    options = parser.parse_args(arguments)
    programs = choice.prepare()
    from hcpg.loops.assessing import assess, summary

    trained = choice.load(options)
    head = f"{trained.settings.task}, {trained.settings.preset} s{trained.seed} at step {trained.step:,}, "
    sys.stdout.write(f"{head}adapter {trained.settings.adapter}\n")
    sys.stdout.flush()
    sys.stdout.write(summary(assess(trained, options.episodes, machine.cores())) + "\n")
    if programs is not None:
        programs.close()
    return 0


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number of at least 1")
    return int(text)
