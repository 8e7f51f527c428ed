"""Two presets compared: pairs, refusals, and sentences that claim no more than the numbers."""

import gzip

import numpy as np
import pytest

from hcpg.report.comparison import compared, outcomes
from hcpg.report.records import RecordError


def folder_of(write_run, preset, successes, **others):
    """One run per seed; its last evaluation has that many successes of 10."""
    paths = [
        write_run(preset=preset, seed=seed, bare=[0, each], **others) for seed, each in enumerate(successes)
    ]
    return paths[0].parents[1]


def told(first, second, selector=None):
    return compared(outcomes(first, selector), outcomes(second, selector)).splitlines()


def test_a_clear_difference_over_many_seeds_is_called_one(write_run):
    lines = told(folder_of(write_run, "a", [10] * 5), folder_of(write_run, "b", [2, 3, 1, 2, 2]))
    assert lines[0] == (
        "point/reach, adapter paper, last evaluation at step 200, seeds 0 1 2 3 4, 10 start states"
    )
    assert lines[1] == "a (bare): 100.0 [92.9, 100.0] (50/50), by seed 100 100 100 100 100"
    assert lines[3] == "difference +80.0 points"
    assert lines[-1] == "a (bare) is better than b (bare) on these start states (95 %)."


def test_the_better_one_is_named_whichever_comes_first(write_run):
    weak, strong = folder_of(write_run, "weak", [0] * 5), folder_of(write_run, "strong", [9] * 5)
    assert told(weak, strong)[-1].startswith("strong (bare) is better than weak (bare)")


def test_a_lost_seed_leaves_it_undecided_and_asks_for_seeds_not_episodes(write_run):
    """100 100 100 against 100 0 100: the episodes alone would seem to settle it."""
    lines = told(folder_of(write_run, "a", [10, 10, 10]), folder_of(write_run, "b", [10, 0, 10]))
    assert lines[4] == "  paired, seeds and start states resampled: [+0.0, +100.0]"
    assert "[+" in lines[5]
    assert lines[-1] == (
        "Undecided: the interval includes zero; 3 seeds say little of other seeds. "
        "If seeds spread as these do, 25 of each would tell them apart with 80 % power."
    )


def test_one_seed_is_said_to_say_nothing_of_others(write_run):
    lines = told(folder_of(write_run, "a", [10]), folder_of(write_run, "b", [0]))
    assert lines[-1].endswith(
        "is better than b (bare) on these start states (95 %); one seed says nothing of other seeds."
    )
    lines = told(folder_of(write_run, "c", [6]), folder_of(write_run, "d", [5]))
    assert "episodes of each would, with 80 % power." in lines[-1]
    lines = told(folder_of(write_run, "e", [5]), folder_of(write_run, "f", [5]))
    assert lines[-1] == "Undecided: the rates are equal; one seed says nothing of other seeds."


def test_pairs_are_of_one_start_state(write_run):
    root = folder_of(write_run, "a", [3, 7])
    found = outcomes(root)
    assert (found.seeds, found.starts) == ((0, 1), tuple(range(10)))
    np.testing.assert_array_equal(found.successes, np.arange(10) < np.array([[3], [7]]))


def test_seeds_that_only_one_of_them_has_are_left_out(write_run):
    lines = told(folder_of(write_run, "a", [10, 10]), folder_of(write_run, "b", [0, 0, 10]))
    assert "seeds 0 1," in lines[0]
    assert lines[2].endswith("(0/20), by seed 0 0")


def test_a_selector_can_be_named(write_run):
    first = folder_of(write_run, "a", [1, 1], success=[0, 8])
    second = folder_of(write_run, "b", [2, 2], success=[0, 9])
    assert told(first, second)[1].startswith("a (hcpg):  80.0")
    assert told(first, second, "bare")[1].startswith("a (bare):  10.0")
    with pytest.raises(RecordError, match=r"evaluation with 'mean'; there are evaluations with bare, hcpg"):
        outcomes(first, "mean")


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"task": "point/carry"}, r"cannot mix task \(point/reach: a; point/carry: b\)"),
        ({"episodes": 8}, r"cannot mix evaluation episodes \(10: a; 8: b\)"),
    ],
)
def test_unlike_protocols_are_refused(others, message, write_run):
    first, second = folder_of(write_run, "a", [5]), folder_of(write_run, "b", [5], **others)
    with pytest.raises(RecordError, match=message):
        told(first, second)


def test_other_steps_and_other_seeds_are_refused(write_run):
    first = folder_of(write_run, "a", [5])
    longer = write_run(preset="b", bare=[1, 2, 3])
    with pytest.raises(RecordError, match=r"cannot mix steps \(200: a; 300: b\)"):
        told(first, longer)
    elsewhere = write_run(preset="c", seed=4, bare=[1, 2])
    with pytest.raises(RecordError, match=r"no seed in common: \(0,\) and \(4,\)"):
        told(first, elsewhere)


def test_a_folder_of_several_presets_is_refused_by_name(write_run):
    folder_of(write_run, "a", [5])
    root = folder_of(write_run, "b", [5]).parent
    with pytest.raises(RecordError, match="holds a on point/reach, b on point/reach; name the folder"):
        outcomes(root)


def test_a_damaged_stored_table_is_named(write_run):
    path = write_run(preset="a", bare=[1, 2]) / "episodes.jsonl"
    packed = gzip.compress(path.read_bytes())
    path.unlink()
    path.with_name("episodes.jsonl.gz").write_bytes(packed[: len(packed) // 2])
    with pytest.raises(RecordError, match=r"episodes\.jsonl\.gz is damaged"):
        outcomes(path.parent)


def test_stored_runs_with_compressed_rows_are_read_alike(write_run):
    root = folder_of(write_run, "a", [3, 7])
    before = outcomes(root)
    for plain in root.rglob("*.jsonl"):
        plain.with_name(plain.name + ".gz").write_bytes(gzip.compress(plain.read_bytes()))
        plain.unlink()
    after = outcomes(root)
    assert (after.protocol, after.seeds) == (before.protocol, before.seeds)
    np.testing.assert_array_equal(after.successes, before.successes)
