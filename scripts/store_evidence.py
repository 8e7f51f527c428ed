"""Keep runs as evidence: curves, table, and each run's settings and raw rows, compressed.

Usage: store_evidence.py FOLDER RUNS... ; RUNS are run folders or folders of them. What is written is small
enough for the repository, and free of this machine's paths.
"""

import argparse
import gzip
import json
import shutil
from pathlib import Path

from hcpg.report.figures import learning_curves
from hcpg.report.records import Group, Record, load_runs
from hcpg.report.tables import markdown

PACKAGES = ("python", "jax", "jaxlib", "equinox", "optax", "numpy", "mujoco", "metaworld")
TABLES = ("episodes.jsonl", "metrics.jsonl")


def main() -> None:
    """Write everything into the folder, which must not exist yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("runs", type=Path, nargs="+")
    options = parser.parse_args()
    options.folder.mkdir(parents=True)
    groups = load_runs(options.runs)
    learning_curves(groups, options.folder / "learning_curves")
    (options.folder / "README.md").write_text(f"{commands(groups)}\n{markdown(groups)}")
    for run in (run for group in groups for run in group.runs):
        store(run, options.folder / "runs" / run.preset / f"s{run.seed}")


def commands(groups: list[Group]) -> str:
    """The command that makes each group again; the settings it resolves to are beside each run."""
    lines = ["# Evidence", "", "```sh"]
    for group in groups:
        seeds = " ".join(str(run.seed) for run in group.runs)
        budget = json.loads((group.runs[0].path / "config.json").read_text())["budget"]
        lines.append(
            f"hcpg train --task {group.task} --preset {group.preset} --budget {budget['name']} "
            f"--steps {budget['steps']} --seeds {seeds}"
        )
    return "\n".join([*lines, "```", ""])


def store(run: Record, folder: Path) -> None:
    """One run's settings, provenance and rows."""
    folder.mkdir(parents=True)
    shutil.copy(run.path / "config.json", folder)
    manifest = json.loads((run.path / "manifest.json").read_text())
    manifest["versions"] = {name: manifest["versions"].get(name) for name in PACKAGES}
    for private in ("command", "platform"):  # the first holds paths; README.md has the command
        del manifest[private]
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    for table in TABLES:
        packed = gzip.compress((run.path / table).read_bytes(), mtime=0)
        (folder / f"{table}.gz").write_bytes(packed)


if __name__ == "__main__":
    main()
