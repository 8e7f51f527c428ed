"""Time and memory of `hcpg report` on generated runs, each with all the rows that the cpu budget writes."""

import argparse
import itertools
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from hcpg import presets

METHODS = ("sac", "flowrl", "qsm", "sac_flow", "hcpg_flow")
SEEDS = 20
TRAINING_EPISODES = 120
"""Of 500 steps in 60,000."""
HEAD = (
    '{{"step": {step}, "phase": "{phase}", "selector": "{selector}", "adapter": "paper", '
    '"environment": {place}, "start": {start}, '
)
TAILS = tuple(
    f'"success_once": {success}, "success_at_end": {success}, "steps_to_success": {first}, "return": '
    for success, first in (("false", -1), ("true", 100))
)
"""Of a failure and of a success."""
METRICS = 100
"""Rows of a run's `metrics.jsonl`."""
PACKAGES = 200
"""Packages in a manifest."""


def generate(root: Path, runs: int) -> int:
    """Write the runs and give the bytes of their episodes; success rises over training."""
    random, written = np.random.default_rng(0), 0
    for number in range(runs):
        task, seed, name = (
            number // (len(METHODS) * SEEDS),
            number // len(METHODS) % SEEDS,
            number % len(METHODS),
        )
        settings = presets.settings(f"made/task-{task:02d}", METHODS[name])
        folder = root / settings.task / settings.preset / f"s{seed}" / f"20260101T000000Z-{number:08x}"
        folder.mkdir(parents=True)
        text = "".join(_lines(random, settings.budget))
        (folder / "episodes.jsonl").write_text(text)
        written += len(text)
        _parts(folder, settings, seed)
    return written


def _lines(random: np.random.Generator, budget: presets.Budget) -> Iterator[str]:
    """Training episodes, then evaluations with a selector and bare, as the loops write them."""
    heads, shares = zip(*_heads(budget), strict=True)
    successes = random.random(len(heads)) < np.array(shares) * random.random()
    returns = 1e4 * random.random(len(heads))
    for head, success, value in zip(heads, successes.tolist(), returns.tolist(), strict=True):
        yield f'{head}{TAILS[success]}{value}, "length": 500}}\n'


@cache
def _heads(budget: presets.Budget) -> list[tuple[str, float]]:
    """How every line of a run begins, and the share of the training before it."""
    heads = []
    for number in range(TRAINING_EPISODES):
        share, start = number / TRAINING_EPISODES, 1_000_003 * number
        facts = {"phase": "train", "selector": "hcpg", "place": number % 8, "start": start}
        heads.append((HEAD.format(step=round(share * budget.steps), **facts), share))
    for number, selector in itertools.product(range(1, budget.evaluations + 1), ("hcpg", "bare")):
        share = number / budget.evaluations
        for start in range(budget.evaluation_episodes):
            facts = {"phase": "evaluation", "selector": selector, "place": start % 8, "start": start}
            heads.append((HEAD.format(step=round(share * budget.steps), **facts), share))
    return heads


def _parts(folder: Path, settings: presets.Settings, seed: int) -> None:
    """The other files of a run folder."""
    manifest = {
        "run": {"id": folder.name, "task": settings.task, "preset": settings.preset, "seed": seed},
        "time": "2026-01-01T00:00:00Z",
        "command": f"hcpg train --task {settings.task} --preset {settings.preset} --seeds {seed}",
        "versions": {f"package-{number}": "1.0.0" for number in range(PACKAGES)},
        "code": {"commit": "0" * 40, "dirty": False},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=2))
    (folder / "config.json").write_text(json.dumps(settings.as_json(), indent=2))
    (folder / "status.json").write_text('{"state": "finished", "step": 60000}')
    rows = ({"step": 600 * k, "wall_s": 5.0 * k, "steps_per_s": 120.0} for k in range(1, METRICS + 1))
    (folder / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))


def main() -> None:
    """Generate, run the command in a process of its own, and print what it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "runs"
        size = generate(root, asked.runs)
        command = [sys.executable, "-m", "hcpg", "report", str(root), "--no-figures"]
        began = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - began
        page = (root / "report/report.html").stat().st_size
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = {
        "runs": asked.runs,
        "seconds": seconds,
        "processor_seconds": used.ru_utime + used.ru_stime,
        "peak_gib": used.ru_maxrss / 2**20,
        "episodes_gib": size / 2**30,
        "page_mib": page / 2**20,
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
