"""`hcpg report`: the paper's tables and figures of all runs in a folder, and one page to look at them."""

import argparse
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hcpg.registry import UnknownNameError

if TYPE_CHECKING:
    from hcpg.report.records import Group

DESCRIPTION = """Write one page (report.html, which needs no network), the paper's tables (Markdown, LaTeX,
CSV) and figures (png, svg, pdf, each with a caption) of all runs under DIR, and print the main table:
last-five success, curves, bars, learning progress, and the ablation and candidate counts where such runs are
there; and the table of `hcpg robot trials`. All runs must have one protocol."""
PAGE = "report.html"


def run(arguments: Sequence[str]) -> int:
    """Write the files and say where they are."""
    options = _parser().parse_args(arguments)
    from hcpg.report.notices import noticed
    from hcpg.report.page.content import Request
    from hcpg.report.page.writing import write_page
    from hcpg.report.paper_figures import write_figures
    from hcpg.report.provenance import provenance, signed
    from hcpg.report.records import load_runs
    from hcpg.report.trial_files import write_figure, write_tables
    from hcpg.report.trial_records import find_studies

    with noticed() as notices:
        groups = _chosen(load_runs(options.runs, options.skip_corrupt), options)
        texts, command = _tables(groups), shlex.join(["hcpg", "report", *arguments])
        out, origin = options.out or options.runs[0] / "report", provenance(groups, command)
        out.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (out / name).write_text(signed(name, text, origin))
        pictures = [] if options.no_figures else write_figures(groups, out, command)
        if studies := find_studies(*options.runs):
            pictures += write_tables(studies, out, command)[1]
            pictures += [] if options.no_figures else write_figure(studies, out, command)
    request = Request(
        roots=options.runs,
        out=out / PAGE,
        command=command,
        commit=origin.commit,
        reference=options.reference,
        figures=sorted(out.iterdir()),
        notices=notices,
    )
    page = write_page(groups, request, texts["table.md"])
    files = [str(page), *(str(out / name) for name in texts), *map(str, pictures)]
    sys.stdout.write(f"{texts['table.md']}\n" + "\n".join(files) + "\n")
    return 0


def _tables(groups: "Sequence[Group]") -> dict[str, str]:
    """All tables by file name."""
    from hcpg.report import ablation_tables, paper_tables

    table = paper_tables.main_table(groups)
    forms = {"md": paper_tables.markdown, "tex": paper_tables.latex, "csv": paper_tables.as_csv}
    return {f"table.{kind}": form(table) for kind, form in forms.items()} | ablation_tables.files(groups)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="hcpg report", description=DESCRIPTION)
    parser.add_argument("runs", type=Path, nargs="+", metavar="DIR", help="run folders, or folders of them")
    parser.add_argument("--out", type=Path, help="where to write; default: DIR/report of the first DIR")
    parser.add_argument("--tasks", nargs="+", default=[], metavar="TASK", help="only these; default: all")
    parser.add_argument("--presets", nargs="+", default=[], metavar="PRESET", help="only these; default: all")
    parser.add_argument(
        "--reference",
        metavar="PRESET",
        help="what the page compares the others with; default: hcpg_flow, or else the first column",
    )
    parser.add_argument("--skip-corrupt", action="store_true", help="name unreadable runs and leave them out")
    parser.add_argument("--no-figures", action="store_true", help="page and tables alone, which is quick")
    return parser


def _chosen(groups: "Sequence[Group]", options: argparse.Namespace) -> "list[Group]":
    """The groups of the named tasks and presets, of all where none is named."""
    tasks, presets = options.tasks, options.presets
    _check("task", tasks, {group.task for group in groups})
    _check("preset", presets, {group.preset for group in groups})
    chosen = [
        group
        for group in groups
        if (not tasks or group.task in tasks) and (not presets or group.preset in presets)
    ]
    _check("reference", [options.reference or chosen[0].preset], {group.preset for group in chosen})
    return chosen


def _check(kind: str, asked: Iterable[str], known: set[str]) -> None:
    for name in asked:
        if name not in known:
            raise UnknownNameError(kind, name, sorted(known))
