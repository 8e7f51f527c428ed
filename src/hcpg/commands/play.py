"""`hcpg play`: a video of a trained run."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hcpg.commands import choice


def run(arguments: Sequence[str]) -> int:
    """Write the video and say where it is."""
    description = "Make a video of a trained run, from the evaluation's start states."
    parser = argparse.ArgumentParser(prog="hcpg play", description=description)
    choice.add_options(parser)
    parser.add_argument(
        "--episodes", type=int, choices=range(1, 51), default=2, metavar="1..50", help="default: 2"
    )
    parser.add_argument("--out", type=Path, help="an mp4 file; default: one in RUN/videos/")
    options = parser.parse_args(arguments)
    programs = choice.prepare()
    from hcpg.loops.playing import play

    played = play(choice.load(options), options.episodes, options.out)
    told = ", ".join("success" if success else "no success" for success in played.successes)
    sys.stdout.write(f"{played.file} ({told})\n")
    if programs is not None:
        programs.close()
    return 0
