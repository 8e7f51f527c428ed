"""Keep runs as evidence: table, and each run's settings and raw rows, compressed.

Usage: store_evidence.py FOLDER RUNS... ; RUNS are run folders or folders of them. Runs of a preset are seeds
of one experiment, shown with their curves; with --each-run every run stands for itself, whatever it is.
What is written is small enough for the repository, and free of this machine's paths.
"""

import argparse
from pathlib import Path

from hcpg.experiments.storing import options, store
from hcpg.report.figures import CAPTION, learning_curves
from hcpg.report.pictures import save
from hcpg.report.provenance import provenance
from hcpg.report.records import BARE, Group, Record, find_runs, load_run, load_runs
from hcpg.report.tables import aligned, markdown

EACH_RUN = """# Runs, each by itself

Each row is `hcpg train --task TASK --preset PRESET --seeds SEED` with the options given, which are those
that differ from the preset and its budget of today. Success of every evaluation, in percent, in the order of
training; a run that has fewer than its budget names was stopped.
"""


def main() -> None:
    """Write everything into the folder, which must not exist yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument("--each-run", action="store_true", help="a row per run, no curves")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True)
    (store_each if asked.each_run else store_groups)(asked.folder, asked.runs)


def store_groups(folder: Path, roots: list[Path]) -> None:
    """The seeds of each preset together."""
    groups = load_runs(roots)
    (folder / "README.md").write_text(f"{commands(groups)}\n{markdown(groups)}")
    for run in (run for group in groups for run in group.runs):
        several = len({group.task for group in groups}) > 1
        store(
            run.path,
            folder / "runs" / (run.task.replace("/", "-") if several else "") / run.preset / f"s{run.seed}",
        )
    # Of what is stored: the commands of the runs hold paths, README.md has them without.
    groups = load_runs([folder / "runs"])
    origin = provenance(groups, "scripts/store_evidence.py")
    save(learning_curves(groups), folder / "learning_curves", CAPTION, origin)


def commands(groups: list[Group]) -> str:
    """The command that makes each group again.

    Raises:
        SystemExit: the seeds of a preset differ in more than the seed.
    """
    lines = ["# Evidence", "", "```sh"]
    for group in groups:
        distinct = {" ".join(options(run.path)) for run in group.runs}
        if len(distinct) > 1:
            raise SystemExit(f"{group.preset} on {group.task}: its seeds have different settings: {distinct}")
        seeds = " ".join(str(run.seed) for run in group.runs)
        lines.append(
            f"hcpg train --task {group.task} --preset {group.preset} {distinct.pop()} --seeds {seeds}"
        )
    return "\n".join([*lines, "```", ""])


def store_each(folder: Path, roots: list[Path]) -> None:
    """Every run that was evaluated at least once, by itself."""
    runs = [load_run(path) for root in roots for path in find_runs(root)]
    runs = [run for run in runs if run.curves]
    rows = sorted(
        [run.task, run.preset, " ".join(options(run.path)), str(run.seed), *curves(run)] for run in runs
    )
    heading = ["task", "preset", "options", "seed", "with the selector", "bare"]
    (folder / "README.md").write_text(f"{EACH_RUN}\n{aligned([heading, *rows])}\n")
    for run in runs:
        store(run.path, folder / "runs" / run.path.name)


def curves(run: Record) -> list[str]:
    """Success with the selector and bare."""
    return [
        " ".join(f"{100 * rate:.0f}" for rate in run.curves[name].rates) if name in run.curves else "-"
        for name in (run.selector, BARE)
    ]


if __name__ == "__main__":
    main()
