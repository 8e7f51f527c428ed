"""A page about four runs of two presets, whose numbers are small enough to work out by hand."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from hcpg import cli
from hcpg.report.records import load_runs
from hcpg.report.video import write_video

SCRIPTS = Path(__file__).parents[3] / "scripts"
HOSTILE = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="session")
def photography():
    """The script that opens pages, as a dict of what it defines."""
    return runpy.run_path(str(SCRIPTS / "photograph_page.py"))


@pytest.fixture(scope="session")
def root(tmp_path_factory, run_writer):
    """`hcpg_flow` on two tasks, `sac_flow` and one whose name would be markup on one of them; two seeds."""
    root = tmp_path_factory.mktemp("runs")
    write = run_writer(root)
    for seed in (0, 1):
        drawer = {"seed": seed, "task": "metaworld/drawer-open"}
        write(preset="hcpg_flow", success=[2, 4, 6, 8, 10], bare=[0, 0, 1, 2, 5], **drawer)
        write(preset="sac_flow", bare=[10 * seed] * 5, **drawer)
        path = write(preset="odd", bare=[0, 1, 2, 3, 4], **drawer)
        manifest = (path / "manifest.json").read_text().replace('"odd"', f'"{HOSTILE}"')
        (path / "manifest.json").write_text(manifest)
        path = write(preset="hcpg_flow", success=[9] * 5, bare=[3] * 5, seed=seed, task="point/reach")
        if seed == 1:
            frames = np.zeros((3, 32, 48, 3), np.uint8)
            write_video(frames, path / "videos/step_000000500_hcpg.mp4", fps=5)
    return root


@pytest.fixture(scope="session")
def groups(root):
    return load_runs([root])


@pytest.fixture(scope="session")
def page(root):
    """The page that the command writes."""
    assert cli.main(["report", str(root), "--no-figures"]) == 0
    return root / "report/report.html"
