"""What is kept of a run is what reports and `status` need, and names nothing of the machine."""

import json

from stand_in_jobs import create
from tiny_cells import cell

from hcpg.experiments import ledger
from hcpg.experiments.storing import store, store_all
from hcpg.report.records import load_run

EPISODE = {
    "selector": "bare",
    "adapter": "paper",
    "environment": 0,
    "success_once": True,
    "success_at_end": False,
    "steps_to_success": 3,
    "return": 1.5,
    "length": 60,
}


def ended(each, results, state="finished"):
    folder = create(each, results)
    manifest = folder.manifest()
    told = {"command": f"hcpg train --out {results}", "platform": {"host": "mine"}}
    manifest |= {**told, "versions": {"jax": "1.0", "some-package": "2.0"}}
    (folder.path / "manifest.json").write_text(json.dumps(manifest))
    rows = [{"step": 64, "phase": "evaluation", "start": start, **EPISODE} for start in (0, 1)]
    folder.append("episodes", rows)
    folder.append("metrics", [{"step": 64, "wall_s": 2.0}])
    folder.set_status(state)
    return folder


def test_a_stored_run_counts_as_finished_and_gives_the_same_numbers(tmp_path):
    cells = [cell(seed) for seed in range(3)]
    whole = ended(cells[0], tmp_path / "out")
    ended(cells[1], tmp_path / "out", state="stopped")
    diverged = ended(cells[2], tmp_path / "out", state="diverged")
    new = store_all(tmp_path / "out", tmp_path / "kept")
    assert sorted(new) == sorted(
        tmp_path / "kept" / each.path.relative_to(tmp_path / "out") for each in (whole, diverged)
    )
    found = ledger.entries(cells, tmp_path / "kept")
    assert [entry.state for entry in found] == ["finished", "left", "diverged"]
    stored, original = load_run(found[0].folder), load_run(whole.path)
    assert stored.curves["bare"].successes.tolist() == original.curves["bare"].successes.tolist() == [2]
    assert (stored.config, stored.wall_s) == (original.config, 2.0)
    assert store_all(tmp_path / "out", tmp_path / "kept") == []


def test_a_stored_run_can_be_stored_anew(tmp_path):
    whole = ended(cell(0), tmp_path / "out")
    store(whole.path, tmp_path / "once")
    store(tmp_path / "once", tmp_path / "twice")
    files = sorted(path.name for path in (tmp_path / "once").iterdir())
    assert files == sorted(path.name for path in (tmp_path / "twice").iterdir())
    for name in files:
        assert (tmp_path / "once" / name).read_bytes() == (tmp_path / "twice" / name).read_bytes()


def test_it_names_the_command_that_makes_it_again_and_no_place(tmp_path):
    ended(cell(4), tmp_path / "out")
    [folder] = store_all(tmp_path / "out", tmp_path / "kept")
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["command"].startswith(
        "hcpg train --task point/reach --preset sac --budget cpu --steps 64 --learner."
    )
    assert "--budget.steps" not in manifest["command"]
    assert manifest["command"].endswith("--seeds 4")
    assert manifest["versions"] == {"jax": "1.0"}
    for file in folder.glob("*.json"):
        assert str(tmp_path) not in file.read_text()
        assert "mine" not in file.read_text()
