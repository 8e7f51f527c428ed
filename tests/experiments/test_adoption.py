"""What tables share is made once."""

from stand_in_jobs import create
from tiny_cells import cell

from hcpg.experiments.adoption import adopt
from hcpg.experiments.claims import claim_of, locked
from hcpg.experiments.ledger import entries
from hcpg.loops.runs import RunFolder


def finished(each, results):
    folder = create(each, results)
    folder.append("metrics", [{"step": 64, "wall_s": 2.0}])
    checkpoint = folder.checkpoints / "step_000000064"
    checkpoint.mkdir()
    for name in ("facts.json", "state.safetensors"):
        (checkpoint / name).write_text(name)
    folder.set_status("finished")
    return folder


def test_a_finished_run_of_a_neighbour_is_taken_over_whole_and_nothing_else(tmp_path):
    cells = [cell(seed) for seed in range(3)]
    theirs = finished(cells[0], tmp_path / "ablation")
    create(cells[1], tmp_path / "ablation").set_status("stopped")
    finished(cell(2, steps=128), tmp_path / "ablation")
    results, neighbours = tmp_path / "k_sensitivity", [tmp_path / "ablation", tmp_path / "none"]
    [taken] = adopt(cells, results, neighbours)
    assert taken == results / theirs.path.relative_to(tmp_path / "ablation")
    assert [entry.state for entry in entries(cells, results)] == ["finished", "left", "left"]
    assert sorted(path.name for path in taken.rglob("*")) == sorted(
        path.name for path in theirs.path.rglob("*")
    )
    array = "checkpoints/step_000000064/state.safetensors"
    assert (taken / array).samefile(theirs.path / array)
    RunFolder(taken).append("metrics", [{"step": 128, "wall_s": 4.0}])
    assert len(theirs.rows("metrics")) == 1
    assert adopt(cells, results, neighbours) == []


def test_of_two_neighbours_one_gives_the_run_and_what_is_there_stays(tmp_path):
    for name in ("one", "two"):
        finished(cell(0), tmp_path / name)
    own = finished(cell(1), tmp_path / "own")
    finished(cell(1), tmp_path / "one")
    [taken] = adopt([cell(0), cell(1)], tmp_path / "own", [tmp_path / "one", tmp_path / "two"])
    assert taken.parent.name == "s0"
    assert entries([cell(1)], tmp_path / "own")[0].folder == own.path


def test_a_cell_that_a_launch_has_is_left_to_it(tmp_path):
    finished(cell(0), tmp_path / "one")
    claim = locked(claim_of(cell(0), tmp_path / "own"))
    assert adopt([cell(0)], tmp_path / "own", [tmp_path / "one"]) == []
    claim.close()
