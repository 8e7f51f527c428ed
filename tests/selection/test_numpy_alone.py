"""A robot computer has NumPy alone, and the selector runs there."""

import os
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src"

PROGRAM = """
import sys

blocked = ["array_api_compat", "beartype", "equinox", "jax", "jaxlib", "jaxtyping", "optax", "scipy", "torch"]
sys.modules.update(dict.fromkeys(blocked))  # a name that maps to None cannot be imported

import numpy as np
from hcpg.selection import Scene, select

scene = Scene.of(np.zeros(3), np.array([0.5, 0.0, 0.0]), np.ones(3))
action, seen = select(np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]]), scene)
print(*np.round(seen.weights, 4), np.round(action[0], 4))
foreign = {name.partition(".")[0] for name in sys.modules} - set(sys.stdlib_module_names) - set(blocked)
print(*sorted(name for name in foreign if not name.startswith("_")))
"""


def test_the_selector_runs_with_numpy_alone():
    # -S leaves installed packages aside; NumPy's own folder is added back.
    import numpy

    paths = os.pathsep.join([str(SOURCE), str(Path(numpy.__file__).parents[1])])
    environment = {**os.environ, "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, "-S", "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    # Two candidates weigh .9457 and .0543, and .5 * (.9457 - .0543) = .4457.
    assert done.stdout.splitlines() == ["0.9457 0.0543 0.4457", "hcpg numpy"]
