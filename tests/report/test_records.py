"""Rows become curves: by step and selector, seeds side by side, nothing counted twice."""

import numpy as np
import pytest

from hcpg.report import reading
from hcpg.report.records import RecordError, find_runs, load_run, load_runs
from hcpg.report.rows import append_rows


def test_a_run_becomes_one_curve_per_selector(write_run):
    record = load_run(write_run(preset="p", seed=2, success=[0, 4, 10], bare=[0, 1, 5]))
    assert (record.task, record.preset, record.seed) == ("point/reach", "p", 2)
    assert (record.adapter, record.selector) == ("paper", "hcpg")
    assert record.curves["hcpg"].steps.tolist() == [100, 200, 300]
    assert record.curves["hcpg"].rates.tolist() == [0.0, 0.4, 1.0]
    assert record.curves["bare"].successes.tolist() == [0, 1, 5]
    assert record.curves["bare"].episodes.tolist() == [10, 10, 10]
    assert record.steps_per_s == 300.0
    assert record.wall_s == 182.0


def test_seeds_are_stacked_at_the_steps_they_share(tmp_path, write_run):
    write_run(preset="p", seed=1, success=[0, 10], bare=[0, 0])
    write_run(preset="p", seed=0, success=[5, 6, 7], bare=[1, 2, 3])
    (group,) = load_runs([tmp_path])
    curve = group.curve("hcpg")
    assert curve is not None
    assert [run.seed for run in group.runs] == [0, 1]
    assert curve.steps.tolist() == [100, 200]
    np.testing.assert_array_equal(curve.rates, [[0.5, 0.6], [0.0, 1.0]])
    assert group.curve("first") is None


def test_groups_are_tasks_and_presets(tmp_path, write_run):
    for preset, selector in (("b", "first"), ("a", "hcpg")):
        write_run(preset=preset, seed=0, selector=selector, success=[1], bare=[1])
    write_run(preset="a", seed=0, success=[1], bare=[1], task="point/carry")
    groups = load_runs([tmp_path / "point" / "reach", tmp_path])
    assert [(group.task, group.preset, group.selector) for group in groups] == [
        ("point/carry", "a", "hcpg"),
        ("point/reach", "a", "hcpg"),
        ("point/reach", "b", "first"),
    ]


def test_of_one_seed_the_newest_evaluated_run_counts(tmp_path, caplog, write_run):
    write_run(preset="p", seed=0, success=[1], bare=[1], run_id="20260101T000000Z-a")
    newer = write_run(preset="p", seed=0, success=[2], bare=[2], run_id="20260102T000000Z-a")
    write_run(preset="p", seed=0, success=[], bare=[], run_id="20260103T000000Z-a")
    write_run(preset="p", seed=0, success=[3], bare=[3], run_id=".making-20260104T000000Z-a")
    (group,) = load_runs([tmp_path])
    assert [run.path for run in group.runs] == [newer]
    assert len(find_runs(tmp_path)) == 3
    assert "20260103T000000Z-a: it has no evaluation yet" in caplog.text
    assert "20260101T000000Z-a:" in caplog.text


def test_what_would_make_a_dishonest_number_is_an_error(tmp_path, write_run, episode_rows):
    with pytest.raises(RecordError, match="no evaluated run under"):
        load_runs([tmp_path])
    path = write_run(preset="p", seed=0, success=[1], bare=[1])
    append_rows(path / "episodes.jsonl", episode_rows(100, "hcpg", 1, 1))
    with pytest.raises(RecordError, match="at step 100 with selector hcpg counts start state 0 twice"):
        load_run(path)
    path = write_run(preset="p", seed=1, success=[1], bare=[1])
    append_rows(path / "episodes.jsonl", episode_rows(200, "hcpg", 1, 1, adapter="contact"))
    with pytest.raises(RecordError, match="mix the adapters contact, paper"):
        load_run(path)


def test_a_corrupt_file_is_named_and_skipped_only_when_asked(tmp_path, caplog, write_run):
    write_run(seed=0, success=[1], bare=[1])
    bad = write_run(seed=1, success=[1], bare=[1])
    lines = (bad / "episodes.jsonl").read_text().splitlines(keepends=True)
    (bad / "episodes.jsonl").write_text("".join([*lines[:3], "garbage\n", *lines[3:]]))
    message = r"s1/a/episodes\.jsonl, line 4 is not JSON: b'garbage'.* leave the run out with --skip-corrupt"
    with pytest.raises(RecordError, match=message):
        load_runs([tmp_path])
    (group,) = load_runs([tmp_path], skip_corrupt=True)
    assert [run.seed for run in group.runs] == [0]
    assert f"skipped a corrupt run: {bad / 'episodes.jsonl'}, line 4" in caplog.text


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("config.json", '{"budget', r"config\.json is damaged \(Unterminated string"),
        ("status.json", "[]", r"status\.json holds no JSON object"),
        ("manifest.json", '{"run": {"task": "t"}}', r"manifest\.json does not say task, preset and seed"),
        ("config.json", None, r"there is no .*config\.json"),
    ],
)
def test_a_damaged_part_of_a_run_is_named(name, text, message, write_run):
    path = write_run(success=[1], bare=[1])
    (path / name).unlink() if text is None else (path / name).write_text(text)
    with pytest.raises(RecordError, match=message):
        load_run(path)


def test_equal_settings_are_one_object_however_many_runs_have_them(tmp_path, write_run):
    for seed in (0, 1):
        write_run(seed=seed, success=[1], bare=[1])
    first, second = load_runs([tmp_path])[0].runs
    assert first.config is second.config
    assert (first.name, first.config["budget"]) == ("p on point/reach s0", {"name": "cpu"})


def test_several_processes_read_what_one_reads(tmp_path, caplog, monkeypatch, write_run):
    for seed in range(6):
        write_run(seed=seed, success=[seed, 5], bare=[0, 1], run_id=f"20260101T00000{seed}Z-a")
    torn, bad = (load_runs([tmp_path])[0].runs[seed].path / "episodes.jsonl" for seed in (1, 4))
    torn.write_bytes(torn.read_bytes() + b'{"step": 2')
    bad.write_text("garbage\n")
    alone = load_runs([tmp_path], skip_corrupt=True)
    said = caplog.messages
    caplog.clear()
    monkeypatch.setattr(reading.os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(reading, "WORTH_A_PROCESS", 3)
    monkeypatch.setattr(reading, "AT_ONCE", 2)
    monkeypatch.setattr(reading, "measure", None)  # here, not in the processes
    together = load_runs([tmp_path], skip_corrupt=True)
    assert [run.seed for run in together[0].runs] == [0, 1, 2, 3, 5]
    for one, other in zip(alone[0].runs, together[0].runs, strict=True):
        assert one.path == other.path
        np.testing.assert_equal(one.curves, other.curves)
        np.testing.assert_equal(one.episodes, other.episodes)
        assert other.config is together[0].runs[0].config  # what the page counts by identity
    assert len(said) == 2
    assert caplog.messages == said
    with pytest.raises(RecordError, match=r"line 1 is not JSON: b'garbage'.* --skip-corrupt"):
        load_runs([tmp_path])
