"""Train hcpg_flow and sac_flow side by side; end with a table, their curves and a video. `make demo`.

Options are those of `hcpg train`, e.g. --seeds 0 1 2. Ctrl-C saves; the message says how to go on.
Without options it stops at three quarters of the `cpu` budget, so that two cores need less than ten minutes.
"""

import shutil
import sys
import tempfile
from pathlib import Path

from hcpg import cli
from hcpg.report.figures import CAPTION, learning_curves
from hcpg.report.pictures import save
from hcpg.report.provenance import provenance
from hcpg.report.records import find_runs, load_runs
from hcpg.report.tables import markdown

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "runs" / "demo"
TASK = "metaworld/drawer-open"
PRESETS = ("hcpg_flow", "sac_flow")
LENGTH = {"--steps": "45000", "--budget.evaluations": "9"}
NEEDED_BYTES = 1 << 30


def main(options: list[str]) -> int:
    """Train, then show what came of it; gives the exit code."""
    OUT.mkdir(parents=True, exist_ok=True)
    free = shutil.disk_usage(OUT).free
    if free < NEEDED_BYTES:
        sys.stderr.write(f"demo: {free / 2**30:.1f} GiB are free at {OUT}, it needs 1: free some.\n")
        return 2
    before = set(find_runs(OUT))
    chosen = {each.partition("=")[0] for each in options} & {*LENGTH, "--budget.steps"}
    length = [] if chosen else [word for pair in LENGTH.items() for word in pair]
    code = cli.main(["train", "--task", TASK, "--preset", *PRESETS, "--out", str(OUT), *length, *options])
    made = [path for path in find_runs(OUT) if path not in before]
    if code or not made:
        return code
    groups = load_runs(made)
    stem = Path(tempfile.mkdtemp(prefix="report-", dir=OUT)) / "learning_curves"
    table = markdown(groups)
    stem.with_name("table.md").write_text(table)
    picture, *_ = save(learning_curves(groups), stem, CAPTION, provenance(groups, "make demo"))
    sys.stdout.write(f"\n{table}\ncurves: {picture}\ntable:  {stem.with_name('table.md')}\n")
    for run in (run for group in groups for run in group.runs):
        sys.stdout.write(f"{run.preset}, seed {run.seed}: {run.path}\n")
    shown = next(group.runs[0] for group in groups if group.preset == PRESETS[0])
    sys.stdout.write(f"\nvideo of {shown.preset}, seed {shown.seed}: ")
    sys.stdout.flush()
    cli.main(["play", str(shown.path), "--episodes", "2"])  # without OpenGL it says what is missing
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
