"""`python -m hcpg.loops.control.deployed FOLDER`: load a policy and time it at 30 Hz, without JAX."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hcpg.loops.control.deployed.parcel import PolicyFolderError
from hcpg.loops.control.deployed.policy import Policy
from hcpg.loops.control.deployed.timing import described, latency, measured
from hcpg.registry import UnknownNameError
from hcpg.safety.clock import MachineClock


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what the policy is and how fast it acts; 2 where it cannot be loaded."""
    parser = argparse.ArgumentParser(prog="python -m hcpg.loops.control.deployed", description=__doc__)
    parser.add_argument("folder", type=Path, help="what `hcpg export` wrote")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long to act; default: 10")
    parser.add_argument("--sha256", help="refuse any policy but the one with this digest")
    options = parser.parse_args(arguments)
    try:
        policy = Policy.load(options.folder, options.sha256)
    except (PolicyFolderError, UnknownNameError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    lines = [*described(policy), *measured(latency(policy, options.seconds, MachineClock()))]
    sys.stdout.writelines(f"{line}\n" for line in lines)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
