"""What became of runs, read from their folders."""

import pytest
from tiny_cells import cell

from hcpg.experiments.claims import claim_of, locked
from hcpg.experiments.ledger import entries, newest_checkpoint, recorded
from hcpg.loops.runs import RunFolder


def make(results, each, state=None, wall_s=None):
    folder = RunFolder.create(
        results,
        task=each.settings.task,
        preset=each.settings.preset,
        seed=each.seed,
        config=each.settings.as_json(),
        manifest={},
    )
    if state is not None:
        folder.set_status(state)
    if wall_s is not None:
        folder.append("metrics", [{"step": 1, "wall_s": wall_s}])
    return folder


def states(cells, results):
    return [entry.state for entry in entries(cells, results)]


def test_without_a_results_folder_everything_is_left(tmp_path):
    assert states([cell(0), cell(1)], tmp_path / "none") == ["left", "left"]


@pytest.mark.parametrize("state", ["finished", "diverged", "failed", "stopped"])
def test_a_run_has_the_state_that_it_wrote(state, tmp_path):
    folder = make(tmp_path, cell(0), state)
    found = entries([cell(0)], tmp_path)[0]
    assert (found.state, found.folder) == (state, folder.path)


def test_a_running_run_whose_process_is_gone_is_to_be_resumed(tmp_path):
    folder = make(tmp_path, cell(0))
    assert states([cell(0)], tmp_path) == ["stopped"]
    with folder.lock():
        assert states([cell(0)], tmp_path) == ["running"]
    assert states([cell(0)], tmp_path) == ["stopped"]


def test_runs_of_other_settings_or_seeds_are_none_of_it(tmp_path):
    make(tmp_path, cell(0, steps=128), "finished")
    make(tmp_path, cell(1), "finished")
    assert states([cell(0), cell(1)], tmp_path) == ["left", "finished"]


def test_of_several_runs_of_a_cell_the_newest_counts(tmp_path):
    old, new = make(tmp_path, cell(0), "finished"), make(tmp_path, cell(0), "failed")
    early, late = (old.path.parent / name for name in ("20200101T000000Z-a", "20990101T000000Z-b"))
    old.path.rename(early)
    new.path.rename(late)
    assert entries([cell(0)], tmp_path)[0].folder == late


def test_a_claimed_cell_is_running_even_before_it_has_a_folder_and_a_finished_one_is_finished(tmp_path):
    make(tmp_path, cell(1), "finished")
    claims = [locked(claim_of(cell(seed), tmp_path)) for seed in (0, 1)]
    assert states([cell(0), cell(1)], tmp_path) == ["running", "finished"]
    assert [entry.state for entry in recorded([cell(0), cell(1)], tmp_path)] == ["left", "finished"]
    for claim in claims:
        claim.close()
    assert states([cell(0)], tmp_path) == ["left"]


def test_the_time_a_run_was_suspended_is_not_an_entrys(tmp_path):
    folder = make(tmp_path, cell(0), "stopped")
    rows = [{"step": step, "wall_s": step / 4 + 3600.0 * (step > 16)} for step in range(4, 33, 4)]
    folder.append("metrics", rows)
    [entry] = entries([cell(0)], tmp_path)
    assert (entry.step, entry.seconds) == (32, 8.0)


def test_an_entry_tells_how_far_its_run_is(tmp_path):
    folder = make(tmp_path, cell(0), "stopped", wall_s=8.0)
    folder.append("metrics", [{"step": 32, "wall_s": 9.5}])
    [entry] = entries([cell(0)], tmp_path)
    assert (entry.step, entry.seconds) == (32, 9.5)
    assert newest_checkpoint(folder.path) is None
    for step in (8, 32):
        (folder.checkpoints / f"step_{step:09d}").mkdir()
    assert newest_checkpoint(folder.path) == 32
