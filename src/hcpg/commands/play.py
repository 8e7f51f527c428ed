"""`hcpg play`: a trained run to be watched: video, Rerun recording, still figures."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hcpg.commands import choice

if TYPE_CHECKING:
    from hcpg.loops.playing import Played

DESCRIPTION = """Make a video of a trained run, from the evaluation's start states; on request also what the
selector thought at every step: a recording for the Rerun viewer (open it with `rerun FILE`), or a figure."""


def run(arguments: Sequence[str]) -> int:
    """Write the files and say where they are."""
    parser = _parser()
    options = parser.parse_args(arguments)
    programs = choice.prepare()
    from hcpg.loops.playing import play

    trained = choice.load(options)
    played = play(trained, options.episodes, options.out, options.rerun)
    told = ", ".join("success" if success else "no success" for success in played.successes)
    sys.stdout.write(f"{played.file} ({told})\n")
    if options.rerun is not None:
        sys.stdout.write(f"{options.rerun}\n")
    command = shlex.join(["hcpg", "play", *arguments])
    files = _stills(options, played, trained.folder.path, command)
    sys.stdout.writelines(f"{file}\n" for file in files)
    if programs is not None:
        programs.close()
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="hcpg play", description=DESCRIPTION)
    choice.add_options(parser)
    add = parser.add_argument
    add("--episodes", type=int, choices=range(1, 51), default=2, metavar="1..50", help="default: 2")
    add("--out", type=Path, help="an mp4 file; default: one in RUN/videos/")
    add("--rerun", type=Path, metavar="FILE.rrd", help="record the episodes for the Rerun viewer")
    add(
        "--thinking",
        type=Path,
        metavar="FILE",
        help="a figure of one episode's proposals, scores and weights",
    )
    add(
        "--strip",
        action="store_true",
        help="keyframes of a successful episode, for the figure of `hcpg report`",
    )
    return parser


def _stills(options: argparse.Namespace, played: "Played", run_path: Path, command: str) -> list[Path]:
    """The figures that were asked for, of the first episode with success."""
    from hcpg.report import strips, thinking
    from hcpg.report.pictures import save
    from hcpg.report.provenance import provenance
    from hcpg.report.records import Group, load_run

    written = []
    if options.thinking is not None:
        record = load_run(run_path)
        origin = provenance([Group(record.task, record.preset, (record,))], command)
        figure, caption = thinking.thinking_figure(played.shown), thinking.caption(played.shown)
        written += save(figure, options.thinking.with_suffix(""), caption, origin)
    if options.strip:
        written.append(strips.write_strip(played.shown, played.file.with_suffix(strips.SUFFIX)))
    return written
