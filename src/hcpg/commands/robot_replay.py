"""`hcpg robot replay` and `hcpg robot picture`: what happened in a trial, to be looked at."""

import argparse
import shlex
import sys
from pathlib import Path

REPLAY = "a recording of one trial for the Rerun viewer (open it with `rerun FILE`)"
PICTURE = "completion states of trials, side by side, as in the paper's figure"


def add(actions: "argparse._SubParsersAction") -> None:
    """Declare the two subcommands."""
    replay = actions.add_parser("replay", help=REPLAY, description=f"Write {REPLAY}.")
    replay.add_argument("trial", type=Path, metavar="TRIAL", help="a folder trial_... of `hcpg robot trials`")
    replay.add_argument("--rerun", type=Path, required=True, metavar="FILE.rrd")
    replay.set_defaults(carry_out=_replay)
    picture = actions.add_parser("picture", help=PICTURE, description=f"Draw {PICTURE}.")
    picture.add_argument("trials", type=Path, nargs="+", metavar="TRIAL", help="folders of successful trials")
    picture.add_argument("--out", type=Path, required=True, metavar="STEM", help="of the png, svg and pdf")
    picture.set_defaults(carry_out=_picture)


def _replay(options: argparse.Namespace) -> int:
    from hcpg.report.trial_replay import read_trial
    from hcpg.report.trial_rerun import write_trial

    trial = read_trial(options.trial)
    write_trial(trial, options.rerun)
    sys.stdout.write(f"{trial.title}: {len(trial.ticks)} ticks\n{options.rerun}\n")
    return 0


def _picture(options: argparse.Namespace) -> int:
    from hcpg.report.checkout import commit_text, own_code
    from hcpg.report.completion_states import caption, completion_figure
    from hcpg.report.pictures import save
    from hcpg.report.provenance import Provenance
    from hcpg.report.styles import drawing
    from hcpg.report.trial_replay import read_trial

    trials = [read_trial(path) for path in options.trials]
    command = ["hcpg", "robot", "picture", *map(str, options.trials), "--out", str(options.out)]
    facts = {f"trial {place}": trial.title for place, trial in enumerate(trials, start=1)}
    origin = Provenance(shlex.join(command), commit_text(own_code()), facts)
    with drawing():
        figure = completion_figure(trials)
    files = save(figure, options.out, caption(trials), origin)
    sys.stdout.writelines(f"{file}\n" for file in files)
    return 0
