"""`hcpg track`: runs as TensorBoard event files or W&B runs, after the fact or while they train."""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from hcpg.report.trackers import TRACKERS

DESCRIPTION = """Mirror the JSON lines of runs into TensorBoard event files (RUN/tensorboard) or W&B runs
(RUN/wandb, sent by `wandb sync`; `wandb-online` sends at once). The runs themselves are not touched, so this
may be done again, on another machine, or while they train."""
POLL_S = 2.0


def run(arguments: Sequence[str]) -> int:
    """Mirror every run under the folders given."""
    parser = argparse.ArgumentParser(prog="hcpg track", description=DESCRIPTION)
    parser.add_argument("runs", type=Path, nargs="+", metavar="DIR", help="run folders, or folders of them")
    parser.add_argument("--tracker", nargs="+", choices=list(TRACKERS), required=True, help="where to")
    parser.add_argument("--follow", action="store_true", help="go on until every run has ended")
    options = parser.parse_args(arguments)
    from hcpg.loops.following import Follower
    from hcpg.loops.runs import RunFolder
    from hcpg.report.records import RecordError, find_runs

    paths = [path for root in options.runs for path in find_runs(root)]
    if not paths:
        raise RecordError(f"no run under {', '.join(map(str, options.runs))}. Name a folder that holds runs.")
    followers = {path: Follower(RunFolder(path), options.tracker) for path in paths}
    while followers:
        for path, follower in list(followers.items()):
            follower.update()
            if not options.follow or follower.ended():
                followers.pop(path).close()
                sys.stdout.write(f"{path}\n")
        if followers:
            time.sleep(POLL_S)
    return 0
