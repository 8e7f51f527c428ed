"""PyTorch costs seconds and memory; only an environment of ManiSkill may import it."""

import os
import subprocess
import sys
from pathlib import Path

TRAINING = """
import sys, numpy as np
import hcpg, hcpg.cli
from hcpg import presets, registry
from hcpg.loops import child, evaluation, playing, sitting, training
from hcpg.loops.pool import Pool
from hcpg.loops.worker import Post, Sizes, Station, board_bytes, board_in
from multiprocessing.shared_memory import SharedMemory

heavy = {"torch", "mani_skill", "sapien"}
settings = presets.settings("metaworld/drawer-open")
settings.learner, presets.refuse_unserved(settings)
task = registry.task(settings.task)
suite = registry.suite(task.suite)
sizes = Sizes(1, *suite.spec(task), workers=1)
memory = SharedMemory(create=True, size=board_bytes(sizes))
station = Station({0: suite.make(task, 0)}, 500, board_in(memory, sizes))
station.reset()
station.step()
station.close()
print(sorted(heavy & set(sys.modules)))
for name in registry.task_names():
    each = registry.task(name)
    registry.suite(each.suite).spec(each)
print(sorted(heavy & set(sys.modules)))
del station
memory.unlink()
registry.suite("maniskill").make(registry.task("maniskill/push-cube"), 0).close()
print(sorted(heavy & set(sys.modules)))
"""


def test_training_on_meta_world_imports_no_pytorch_and_making_a_maniskill_environment_does():
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "src")}
    told = subprocess.run(
        [sys.executable, "-c", TRAINING], env=environment, capture_output=True, text=True, check=True
    )
    assert told.stdout.splitlines() == ["[]", "[]", "['mani_skill', 'sapien', 'torch']"]
