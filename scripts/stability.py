"""What each evaluation of a run went with: the critic's error, temperature, entropy, what the selector did.

Usage: stability.py RUNS... ; RUNS are run folders or folders of them, stored ones too. `value` is what the
critics expected of the bare actor's first actions, `return` the discounted rewards that followed; `bias` is
their difference less what the critics count for entropy.
"""

import argparse
import sys
from pathlib import Path

from hcpg.report.records import find_runs, load_run
from hcpg.report.stability import page


def main() -> None:
    """Print a table per run that was evaluated."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=Path, nargs="+")
    found = [load_run(path) for root in parser.parse_args().runs for path in find_runs(root)]
    sys.stdout.write(page([run for run in found if run.curves]))


if __name__ == "__main__":
    main()
