"""`hcpg report`: the paper's table and figures of all runs in a folder."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

DESCRIPTION = """Write the paper's table (table.md, table.tex, table.csv) and figures (curves, bars, learning
progress; as png, svg and pdf with a caption) of all runs under DIR, and print the table. All runs must have
one protocol."""


def run(arguments: Sequence[str]) -> int:
    """Write the files and say where they are."""
    parser = argparse.ArgumentParser(prog="hcpg report", description=DESCRIPTION)
    parser.add_argument("runs", type=Path, nargs="+", metavar="DIR", help="run folders, or folders of them")
    parser.add_argument("--out", type=Path, help="where to write; default: DIR/report of the first DIR")
    options = parser.parse_args(arguments)
    from hcpg.report import paper_tables
    from hcpg.report.paper_figures import write_figures
    from hcpg.report.records import load_runs

    groups = load_runs(options.runs)
    table = paper_tables.main_table(groups)
    out = options.out or options.runs[0] / "report"
    out.mkdir(parents=True, exist_ok=True)
    texts = {
        "table.md": paper_tables.markdown(table),
        "table.tex": paper_tables.latex(table),
        "table.csv": paper_tables.as_csv(table),
    }
    for name, text in texts.items():
        (out / name).write_text(text)
    pictures = write_figures(groups, out, shlex.join(["hcpg", "report", *arguments]))
    files = [*(str(out / name) for name in texts), *map(str, pictures)]
    sys.stdout.write(f"{texts['table.md']}\n" + "\n".join(files) + "\n")
    return 0
