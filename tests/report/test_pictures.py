"""Pictures as files: what made them is inside, the same numbers give the same bytes."""

import json
import subprocess
from pathlib import Path

from PIL import Image

from hcpg.report.figures import learning_curves
from hcpg.report.paper_figures import write_figures
from hcpg.report.pictures import save
from hcpg.report.provenance import provenance
from hcpg.report.records import load_runs


def runs(write_run, **manifest):
    for seed in (0, 1):
        path = write_run(preset="sac", seed=seed, bare=[1, 2, 3, 4, 5])
        file = path / "manifest.json"
        file.write_text(json.dumps(json.loads(file.read_text()) | manifest))
    return load_runs([path.parents[1]])


def test_the_origin_is_what_the_manifests_and_git_say(write_run):
    commit = {"commit": "abcdef0123", "dirty": True}
    found = provenance(runs(write_run, code=commit, command="hcpg train --task t"), "hcpg report x")
    head = subprocess.check_output(["git", "rev-parse", "HEAD"], cwd=Path(__file__).parent, text=True)
    assert found.commit.rstrip("+") == head[:7]
    assert found.facts == {
        "presets": "sac",
        "tasks": "point/reach",
        "seeds": "0 1",
        "budget": "cpu",
        "environment steps": "500",
        "adapter": "paper",
        "episodes per evaluation": "10",
        "runs": "2",
        "runs' commits": "abcdef0+",
        "runs' commands": "hcpg train --task t",
    }


def test_more_tasks_than_a_page_holds_are_left_to_the_page(write_run, tmp_path, caplog):
    [group] = runs(write_run)
    many = [group._replace(task=f"point/task-{number}") for number in range(13)]
    names = {path.name.partition(".")[0] for path in write_figures(many, tmp_path / "out", "c")}
    assert names == {"progress"}
    assert "left out the picture curves: a page holds 12 tasks, not 13" in caplog.text


def test_every_file_carries_caption_and_origin(write_run, tmp_path):
    groups = runs(write_run)
    origin = provenance(groups, "hcpg report here")
    png, svg, pdf, text = save(learning_curves(groups), tmp_path / "a" / "curves", "What is seen.", origin)
    with Image.open(png) as picture:
        inside = picture.text
    assert (inside["Description"], inside["Comment"]) == ("What is seen.", origin.text())
    assert "made by: hcpg report here; commit: " in svg.read_text()
    assert b"hcpg report here" in pdf.read_bytes()
    lines = text.read_text().splitlines()
    assert lines[:3] == ["What is seen.", "", "made by: hcpg report here"]
    assert {"seeds: 0 1", "budget: cpu", "presets: sac", "runs' commits: unknown"} < set(lines)


def test_the_same_numbers_give_the_same_bytes(write_run, tmp_path):
    groups = runs(write_run)
    both = [
        save(learning_curves(groups), tmp_path / name / "curves", "c", provenance(groups, "d"))
        for name in "ab"
    ]
    for one, other in zip(*both, strict=True):
        assert one.read_bytes() == other.read_bytes()
