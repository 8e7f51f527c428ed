"""Runs kept small enough for a repository: settings, provenance and rows, and no path of the machine."""

import gzip
import json
import shlex
import shutil
from pathlib import Path

from hcpg import presets
from hcpg.experiments.ledger import DONE
from hcpg.loops.runs import RunFolder
from hcpg.report.records import find_runs

PACKAGES = ("python", "jax", "jaxlib", "equinox", "optax", "numpy", "mujoco", "metaworld", "mani_skill")
"""Those whose versions a stored manifest keeps."""
COPIED, PACKED = ("config.json", "status.json"), ("episodes.jsonl", "metrics.jsonl")


def store(run: Path, folder: Path) -> None:
    """Write the stored form of the run into a folder that does not exist yet; reports read it like a run.

    A stored run is stored anew, with the command that makes it under the presets of today.
    """
    folder.mkdir(parents=True)
    for name in COPIED:
        shutil.copy(run / name, folder)
    manifest = json.loads((run / "manifest.json").read_text())
    versions = manifest["versions"]
    manifest["versions"] = {name: versions[name] for name in PACKAGES if name in versions}
    manifest["command"] = shlex.join(command(run))
    manifest.pop("platform", None)
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    for name in PACKED:
        packed = run / f"{name}.gz"
        rows = gzip.decompress(packed.read_bytes()) if packed.exists() else (run / name).read_bytes()
        (folder / packed.name).write_bytes(gzip.compress(rows, mtime=0))


def command(run: Path) -> list[str]:
    """What makes the run again from anywhere, under the presets of today."""
    address = RunFolder(run).manifest()["run"]
    named = ["--task", address["task"], "--preset", address["preset"]]
    return ["hcpg", "train", *named, *options(run), "--seeds", str(address["seed"])]


def options(run: Path) -> list[str]:
    """Budget, steps, and whatever else is not as the preset has it."""
    settings = presets.from_json(RunFolder(run).config())
    budget = ["--budget", settings.budget.name, "--steps", str(settings.budget.steps)]
    others = presets.differences(settings)
    if "--budget.steps" in others:
        place = others.index("--budget.steps")
        del others[place : place + 2]
    return budget + others


def store_all(results: Path, kept: Path) -> list[Path]:
    """Store every finished or diverged run under `results` that `kept` lacks; gives the new folders."""
    targets = {run: kept / run.relative_to(results) for run in find_runs(results)}
    new = {
        run: target
        for run, target in targets.items()
        if not target.exists() and RunFolder(run).status()["state"] in DONE
    }
    for run, target in new.items():
        arriving = target.with_name(f".arriving-{target.name}")  # a name that no reader looks at
        shutil.rmtree(arriving, ignore_errors=True)
        store(run, arriving)
        arriving.rename(target)
    return list(new.values())
