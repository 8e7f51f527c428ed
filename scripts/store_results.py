"""Keep an experiment's runs in the repository: settings and raw rows, compressed, without machine's paths.

Usage: store_results.py OUT/NAME results/NAME ; what is stored already stays as it is. `hcpg experiment` takes
stored runs for finished ones, and `hcpg report results/NAME` reads them.
"""

import argparse
from pathlib import Path

from hcpg.experiments.storing import store_all


def main() -> None:
    """Store what is done and say how much that was."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, help="what `hcpg experiment run` made")
    parser.add_argument("kept", type=Path, help="where the stored runs lie")
    asked = parser.parse_args()
    new = store_all(asked.results, asked.kept)
    size = sum(file.stat().st_size for folder in new for file in folder.iterdir())
    print(f"{len(new)} runs stored in {asked.kept}, {size / 2**20:.1f} MiB")


if __name__ == "__main__":
    main()
