"""The page of results: whole groups in tables as `hcpg report` prints them, and the rest counted."""

import re
from pathlib import Path

import numpy as np
import pytest
from stand_in_jobs import create

from hcpg.experiments.protocols import Protocol
from hcpg.experiments.results_page import page
from hcpg.report.paper_tables import main_table, markdown
from hcpg.report.published import PUBLISHED
from hcpg.report.records import load_runs
from hcpg.report.statistics import spread

ROOT = Path(__file__).parents[2]
BUDGET = {"steps": 500, "evaluations": 5, "evaluation_episodes": 4}
PROTOCOL = Protocol(
    "A small table",
    ("maniskill/pick-cube", "maniskill/push-cube"),
    ("sac_flow", "hcpg_flow"),
    seeds=(0, 1),
    changes=BUDGET,
)
# A minute for 50 steps, another one for an evaluation, and an hour that it was suspended.
METRICS = [
    {
        "step": step,
        "wall_s": 1.2 * step + 60.0 * ((step - 1) // 100) + 3600.0 * (step > 250),
        "steps_per_s": 0.8,
    }
    for step in range(50, 501, 50)
]
SUCCESSES = {"hcpg_flow": 4, "sac_flow": 2}


def end(each, results):
    folder, preset = create(each, results), each.settings.preset
    selectors = ("bare", "hcpg") if preset == "hcpg_flow" else ("bare",)
    episode = {
        "adapter": "paper",
        "success_at_end": False,
        "steps_to_success": 3,
        "return": 1.0,
        "length": 50,
    }
    for step in range(100, 501, 100):
        for selector in selectors:
            rows = [
                {"step": step, "phase": "evaluation", "selector": selector, "environment": 0, "start": start}
                | {**episode, "length": 50, "success_once": start < SUCCESSES[preset]}
                for start in range(4)
            ]
            folder.append("episodes", rows)
    folder.append("metrics", METRICS)
    folder.set_status("finished")


def made(tmp_path, cells):
    for each in cells:
        end(each, tmp_path / "small")
    return page(tmp_path, {"small": PROTOCOL, "not begun": PROTOCOL})


def test_without_a_whole_group_there_is_no_table(tmp_path):
    text = made(tmp_path, [each for each in PROTOCOL.cells() if each.seed == 0])
    assert "4 of 8 runs are done" in text
    assert "there is no table" in text
    assert "|" not in text


def test_a_whole_experiment_is_one_table_of_the_plain_command(tmp_path):
    text = made(tmp_path, PROTOCOL.cells())
    assert "8 of 8 runs are done" in text
    assert text.count("hcpg report results/small --out build/report\n") == text.count("hcpg report") == 1
    assert markdown(main_table(load_runs([tmp_path / "small"]))).rstrip() in text
    assert "+50.0 [" in text  # four of four against two of four


def test_tasks_with_other_methods_make_a_table_of_their_own(tmp_path):
    cells = [each for each in PROTOCOL.cells() if each.settings.preset == "hcpg_flow"]
    cells += [
        each for each in PROTOCOL.cells() if each.settings.preset == "sac_flow" and "pick" in each[0].task
    ]
    text = made(tmp_path, cells)
    first = "--tasks maniskill/pick-cube --presets hcpg_flow sac_flow --out"
    second = "--tasks maniskill/push-cube --presets hcpg_flow --out"
    assert 0 < text.index(first) < text.index(second)


def test_ours_stand_beside_the_papers_and_cost_what_training_and_evaluations_took(tmp_path):
    text = made(tmp_path, PROTOCOL.cells())
    assert re.search(r"\| maniskill/pick-cube \| SAC-Flow  \| 50.0 ± 0.0 +\| 57.5 ± 14.2", text)
    assert "These 8 runs cost about 2.0 core-hours" in text


@pytest.mark.parametrize(
    ("suite", "preset", "mean", "deviation"),
    [
        ("metaworld", "sac", 76.1, 17.5),
        ("metaworld", "flowrl", 80.6, 14.2),
        ("metaworld", "qsm", 74.1, 28.3),
        ("metaworld", "sac_flow", 94.7, 6.7),
        ("metaworld", "hcpg_flow", 97.1, 3.5),
        ("maniskill", "flowrl", 74.5, 48.6),
        ("maniskill", "sac_flow", 87.2, 19.8),
        ("maniskill", "hcpg_flow", 96.7, 3.6),
    ],
)
def test_the_papers_cells_have_its_means_over_tasks(suite, preset, mean, deviation):
    cells = [
        each.mean for (task, name), each in PUBLISHED.items() if name == preset and task.startswith(suite)
    ]
    assert len(cells) == {"metaworld": 6, "maniskill": 4}[suite]
    assert spread(np.array(cells)) == pytest.approx((mean, deviation), abs=0.1)


def test_the_page_of_this_repository_is_what_the_stored_runs_make():
    text = (ROOT / "docs/results.md").read_text()
    assert text.partition("by scripts/results_page.py. -->\n\n")[2] == page(ROOT / "results")
