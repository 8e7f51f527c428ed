"""Bytes become arrays: as a JSON parser would have it, damage named by its line, our own lines fast."""

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

from hcpg.report import episodes
from hcpg.report.episodes import read_evaluations
from hcpg.report.rows import RowError, append_rows

EVIDENCE = Path(__file__).parents[2] / "docs/evidence"


@pytest.fixture
def file(tmp_path, episode_rows):
    """Two evaluations of three episodes, the second one with two successes."""
    path = tmp_path / "episodes.jsonl"
    append_rows(path, [{"step": 50, "phase": "train", "start": 0}])
    append_rows(path, [*episode_rows(100, "hcpg", 0, 3), *episode_rows(200, "hcpg", 2, 3)])
    return path


def test_episodes_are_sorted_by_step_and_start_state(file, episode_rows):
    append_rows(file, episode_rows(100, "bare", 1, 2)[::-1])
    found = read_evaluations(file)
    assert found.adapters == {"paper"}
    assert list(found.by_selector) == ["hcpg", "bare"]
    assert found.by_selector["hcpg"].steps.tolist() == [100, 100, 100, 200, 200, 200]
    assert found.by_selector["hcpg"].starts.tolist() == [0, 1, 2, 0, 1, 2]
    assert found.by_selector["hcpg"].successes.tolist() == [False, False, False, True, True, False]
    assert found.by_selector["bare"].starts.tolist() == [0, 1]
    assert found.by_selector["bare"].successes.tolist() == [True, False]


def test_lines_in_another_form_say_the_same(file):
    """Other spaces, another order of keys, one key more."""
    before = read_evaluations(file)
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    others = [dict(reversed({**row, "more": 'a "quoted" word'}.items())) for row in rows]
    file.write_text("".join(json.dumps(row, separators=(",", ":")) + "\n" for row in others))
    after = read_evaluations(file)
    for ours, theirs in zip(before.by_selector["hcpg"], after.by_selector["hcpg"], strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("value", [None, -3.5e-05, 12.0])
def test_lines_that_say_what_the_critic_expected_are_read_the_fast_way(tmp_path, episode_rows, value):
    path = tmp_path / "episodes.jsonl"
    append_rows(
        path, [{**row, "value": value, "discounted_return": 0.25} for row in episode_rows(9, "hcpg", 2, 3)]
    )
    assert min(episodes._cut(path.read_bytes()).heads) >= 0
    assert read_evaluations(path).by_selector["hcpg"].successes.tolist() == [True, True, False]


@pytest.mark.parametrize("path", sorted(EVIDENCE.glob("drawer_open/runs/*/s0/episodes.jsonl.gz")))
def test_the_loops_write_what_is_read_the_fast_way(path):
    """Line for line, and with the same result as the JSON parser's."""
    content = gzip.decompress(path.read_bytes())
    heads = episodes._cut(content).heads
    assert len(heads) == content.count(b"\n") == 360 + 240 * ("hcpg_flow" in str(path))
    assert min(heads) >= 0
    rows = [row for row in map(json.loads, content.splitlines()) if row["phase"] == "evaluation"]
    found = read_evaluations(path.with_suffix(""))
    assert {name: int(each.successes.sum()) for name, each in found.by_selector.items()} == {
        name: sum(row["success_once"] for row in rows if row["selector"] == name)
        for name in found.by_selector
    }


def test_a_torn_last_line_is_dropped_with_one_notice(file, caplog):
    whole = file.read_bytes()
    file.write_bytes(whole[:-30])
    found = read_evaluations(file).by_selector["hcpg"]
    assert (len(found.steps), int(found.successes.sum())) == (5, 2)
    assert len(caplog.records) == 1
    assert re.search(r"episodes\.jsonl: dropped a torn last line \(\d+ bytes\)", caplog.text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"start": 1,', '"start": 01,', "line 3 is not JSON"),
        ('"return": 1.0', '"return": 1.0.0', "line 2 is not JSON"),
        ('"length": 10}', '"length": 10', "line 2 is not JSON"),
        ('"success_once": true', '"success_once": null', r"line 5: 'success_once' is None, need bool"),
        ('"start": 2, ', "", r"line 4: 'start' is 'absent', need int"),
        ('"adapter": "paper", "environment": 1', '"adapter": 7, "environment": 1', "line 3: 'adapter' is 7"),
    ],
)
def test_damage_is_named_by_its_line(file, old, new, message):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(RowError, match=message):
        read_evaluations(file)


def test_a_name_that_no_selector_has_is_refused(file):
    file.write_text(file.read_text().replace('"selector": "hcpg"', '"selector": "h\\"cpg"'))
    with pytest.raises(RowError, match="line 2: 'h\"cpg' or 'paper' is no plain name"):
        read_evaluations(file)


def test_there_are_no_episodes_where_there_is_no_file(tmp_path):
    assert read_evaluations(tmp_path / "episodes.jsonl") == (frozenset(), {})
