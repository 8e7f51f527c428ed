"""`hcpg compare`: the difference of two presets on the same start states, with its interval."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

DESCRIPTION = """Compare the last evaluations of two presets (folders of runs, or single runs), paired on the
same seeds and start states: both rates, the difference with its 95 % intervals, and what may be concluded."""


def run(arguments: Sequence[str]) -> int:
    """Print the comparison."""
    parser = argparse.ArgumentParser(prog="hcpg compare", description=DESCRIPTION)
    parser.add_argument("first", type=Path, metavar="A", help="a run, or the folder of a preset's runs")
    parser.add_argument("second", type=Path, metavar="B", help="the same of what to compare it with")
    parser.add_argument("--selector", help="a rule, or `bare`; default: what each was evaluated with")
    parser.add_argument("--skip-corrupt", action="store_true", help="name unreadable runs and leave them out")
    options = parser.parse_args(arguments)
    from hcpg.report.comparison import compared, outcomes

    first, second = (
        outcomes(root, options.selector, options.skip_corrupt) for root in (options.first, options.second)
    )
    sys.stdout.write(compared(first, second) + "\n")
    return 0
