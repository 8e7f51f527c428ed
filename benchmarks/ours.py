"""One of our runs on button-press, the counterpart of `peer.py`: prints JSON of its steady rate.

Usage: ours.py PRESET SEED. Its worker process shares the core that this process is pinned to.
"""

import json
import os
import sys
import tempfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

WARMUP_STEPS = 2_000
MEASURED_STEPS = 8_000


def main() -> None:
    """Train through the ordinary loop; the rate comes from its own rows of metrics."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    from hcpg import presets
    from hcpg.loops import sitting

    preset, seed = sys.argv[1], int(sys.argv[2])
    settings = presets.settings("metaworld/button-press", preset)
    amount = {"steps": WARMUP_STEPS + MEASURED_STEPS, "warmup_steps": 504, "evaluations": 1}
    amount["updates_per_step"] = 0.25  # as the peer has it
    settings = replace(settings, budget=replace(settings.budget, evaluation_episodes=1, **amount))
    print("ready", flush=True)
    sys.stdin.readline()
    with tempfile.TemporaryDirectory() as root:
        folders = sitting.create_folders(settings, [seed], Path(root))
        sitting.sit(settings, folders, 1, lambda event: None, lambda: False)
        rows = [row for row in folders[0].rows("metrics") if row["step"] > WARMUP_STEPS]
    seconds = sum((row["step"] - before["step"]) / row["steps_per_s"] for before, row in pairwise(rows))
    print(json.dumps({"steps_per_s": (rows[-1]["step"] - rows[0]["step"]) / seconds}))


if __name__ == "__main__":
    main()
