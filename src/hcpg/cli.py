"""The command `hcpg`: finds the subcommand and turns known errors into one clear message.

Nothing heavy is imported before a subcommand runs, so that `--help` answers at once.
"""

import argparse
import difflib
import importlib
import os
import sys
from collections.abc import Sequence

import hcpg

COMMANDS = {
    "train": "train runs of one or more presets and seeds, or continue runs",
    "evaluate": "evaluate a trained run or checkpoint, with any selector",
    "compare": "say how two presets differ on the same start states, with intervals",
    "experiment": "make the runs of a table on all cores, or show how far they are",
    "play": "make a video of a trained run",
    "track": "mirror runs into TensorBoard or W&B, while they train or later",
    "export": "write a trained run's policy for a computer without JAX",
    "report": "write the table and the learning curves of all runs in a folder",
    "robot": "look at an arm or its twin, run episodes on it at 30 Hz, inject faults",
    "list": "show the methods, selectors, tasks, presets and budgets",
    "doctor": "look at this machine: what works, what is missing, and the cure",
}
EXIT_CODES = """exit codes:
  0    done
  1    a run failed, or doctor found something that must be mended
  2    the command cannot be carried out as given; the message says why
  3    a run diverged, the others finished
  130  stopped by Ctrl-C; every run saved its state (hcpg train --resume RUN goes on)
  141  whoever read what it prints has gone (hcpg list | head)
  143  stopped by SIGTERM, likewise
"""
READER_GONE = 141
"""What a shell reports of a process that SIGPIPE ended."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out one command; gives the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser()
    name = parser.parse_args(given[:1]).command
    if name is None:
        parser.print_help()
        return 0
    if name not in COMMANDS:
        near = difflib.get_close_matches(name, COMMANDS, n=1)
        guess = f" Did you mean {near[0]!r}?" if near else ""
        parser.error(f"no command is named {name!r}.{guess} Known: {', '.join(COMMANDS)}.")
    command = importlib.import_module(f"hcpg.commands.{name}")
    try:
        code = command.run(given[1:])
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # Python flushes once more when it ends, and would complain then.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return READER_GONE
    except Exception as error:
        # An error class of our own carries a message for the user; anything else is a bug and shows where.
        if not type(error).__module__.startswith("hcpg."):
            raise
        sys.stderr.write(f"hcpg {name}: {error}\n")
        return 2


def _parser() -> argparse.ArgumentParser:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {what}" for name, what in COMMANDS.items()]
    parser = argparse.ArgumentParser(
        prog="hcpg",
        usage="hcpg COMMAND [OPTIONS]",
        description=hcpg.__doc__,
        epilog="commands (hcpg COMMAND --help says more):\n" + "\n".join(lines) + "\n\n" + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("command", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("--version", action="version", version=hcpg.__version__)
    return parser
