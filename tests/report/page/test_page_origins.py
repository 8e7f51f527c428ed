"""What differs is told apart from what is alike, with how many runs say so."""

import json

from hcpg.report.page.origins import manifest, settings
from hcpg.report.records import load_runs


def told(path, config, **parts):
    (path / "config.json").write_text(json.dumps(config))
    found = json.loads((path / "manifest.json").read_text())
    (path / "manifest.json").write_text(json.dumps({**found, **parts}))


def test_settings_that_differ_have_a_value_per_preset(write_run, tmp_path):
    budget = {"budget": {"name": "cpu"}, "task": "t", "preset": "p"}
    told(write_run(preset="a", bare=[1]), {**budget, "learner": {"rate": 0.1, "depth": 2}})
    told(write_run(preset="b", bare=[1]), {**budget, "learner": {"rate": 0.2}})
    told(write_run(preset="b", bare=[1], task="point/carry"), {**budget, "learner": {"rate": 0.3}})
    found = settings(load_runs([tmp_path]), ["b", "a"])
    assert found["differing"] == [
        {"key": "learner.depth", "values": [None, "2"]},
        {"key": "learner.rate", "values": ["0.2 or 0.3", "0.1"]},
    ]
    assert found["alike"] == {"budget.name": '"cpu"'}


def test_manifests_are_summed_up_and_every_run_has_a_row(write_run, tmp_path):
    config = {"budget": {"name": "cpu"}}
    for seed, commit in enumerate(("a" * 40, "a" * 40, "b" * 40)):
        code = {"commit": commit, "dirty": seed == 2}
        versions = {"jax": "0.10"} if seed else {"jax": "0.10", "numpy": "2.4"}
        told(write_run(seed=seed, bare=[1]), config, code=code, versions=versions, time=f"at {seed}", ratio=1)
    found = manifest(load_runs([tmp_path]), tmp_path)
    assert found["alike"] == {"versions.jax": "0.10", "ratio": "1"}
    assert found["differing"] == {
        "code.commit": [f"{'a' * 40} (2 runs)", f"{'b' * 40} (1 run)"],
        "code.dirty": ["false (2 runs)", "true (1 run)"],
        "versions.numpy": ["2.4 (1 run)", "absent (2 runs)"],
    }
    assert [(row["seed"], row["commit"], row["time"]) for row in found["runs"]] == [
        (0, "aaaaaaa", "at 0"),
        (1, "aaaaaaa", "at 1"),
        (2, "bbbbbbb+", "at 2"),
    ]
    assert found["runs"][0]["folder"] == "point/reach/p/s0/a"


def test_equal_values_under_two_keys_stay_two_facts(write_run, tmp_path):
    told(write_run(bare=[1]), {"budget": {"name": "cpu"}}, batch=1, ratio=1)
    assert manifest(load_runs([tmp_path]), tmp_path)["alike"] == {"batch": "1", "ratio": "1"}
