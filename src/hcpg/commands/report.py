"""`hcpg report`: the paper's table and figures of all runs in a folder."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

DESCRIPTION = """Write the paper's tables (Markdown, LaTeX, CSV) and figures (png, svg, pdf, each with a
caption) of all runs under DIR, and print the main table: last-five success, curves, bars, learning progress,
and the ablation and candidate counts where such runs are there. All runs must have one protocol."""


def run(arguments: Sequence[str]) -> int:
    """Write the files and say where they are."""
    parser = argparse.ArgumentParser(prog="hcpg report", description=DESCRIPTION)
    parser.add_argument("runs", type=Path, nargs="+", metavar="DIR", help="run folders, or folders of them")
    parser.add_argument("--out", type=Path, help="where to write; default: DIR/report of the first DIR")
    options = parser.parse_args(arguments)
    from hcpg.report import ablation_tables, paper_tables
    from hcpg.report.paper_figures import write_figures
    from hcpg.report.provenance import provenance, signed
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
    texts |= ablation_tables.files(groups)
    command = shlex.join(["hcpg", "report", *arguments])
    origin = provenance(groups, command)
    for name, text in texts.items():
        (out / name).write_text(signed(name, text, origin))
    pictures = write_figures(groups, out, command)
    files = [*(str(out / name) for name in texts), *map(str, pictures)]
    sys.stdout.write(f"{texts['table.md']}\n" + "\n".join(files) + "\n")
    return 0
