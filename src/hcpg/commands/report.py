"""`hcpg report`: the paper's table and the learning curves of all runs in a folder."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

DESCRIPTION = """Write the paper's table (table.md, table.tex, table.csv) and the learning curves (curves.png,
curves.svg) of all runs under DIR, and print the table. All runs must have one protocol."""


def run(arguments: Sequence[str]) -> int:
    """Write the files and say where they are."""
    parser = argparse.ArgumentParser(prog="hcpg report", description=DESCRIPTION)
    parser.add_argument("runs", type=Path, nargs="+", metavar="DIR", help="run folders, or folders of them")
    parser.add_argument("--out", type=Path, help="where to write; default: DIR/report of the first DIR")
    options = parser.parse_args(arguments)
    from hcpg.report import paper_tables
    from hcpg.report.figures import learning_curves
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
    pictures = learning_curves(groups, out / "curves")
    files = [*(str(out / name) for name in texts), *map(str, pictures)]
    sys.stdout.write(f"{texts['table.md']}\n" + "\n".join(files) + "\n")
    return 0
