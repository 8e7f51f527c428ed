"""`hcpg robot trials` as a user meets it, on the point arm."""

import json
import os

import pytest

from hcpg import cli

TRIALS = ["robot", "trials", "point/reach", "--robot", "point", "--trials", "2", "--unattended"]
POLICIES = ["--policy", "ours=uniform", "--selector", "ours=hcpg", "--policy", "chance=uniform"]


def test_trials_are_run_once_and_the_table_says_twin(capsys, tmp_path):
    command = [*TRIALS, *POLICIES, "--out", str(tmp_path)]
    assert cli.main(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "all done"
    assert sum(line.startswith("Trial ") for line in said) == 4
    assert not any("ours" in line or "chance" in line for line in said)
    ledger = tmp_path / "point/reach/ledger.jsonl"
    before = ledger.read_bytes()
    assert cli.main(command) == 0
    assert ledger.read_bytes() == before
    capsys.readouterr()
    assert cli.main(["robot", "trials", "--report", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert told.startswith("Trials (twin, in the same process; no arm moved).")
    assert "| Reach | ours" in told
    assert (tmp_path / "trials.tex").exists()


def test_a_changed_plan_is_refused_with_its_hash(capsys, tmp_path):
    command = [*TRIALS, *POLICIES, "--out", str(tmp_path)]
    assert cli.main(command) == 0
    assert cli.main([*command, "--seed", "1"]) == 2
    told = capsys.readouterr().err
    assert "begun under another plan (hash " in told
    assert "seed: 0 in the plan, 1 asked for" in told


def test_nobody_at_the_terminal_is_a_fault(capsys, monkeypatch, tmp_path):
    reading, writing = os.pipe()
    os.close(writing)
    kept = os.dup(0)
    os.dup2(reading, 0)
    try:
        attended = [word for word in TRIALS if word != "--unattended"]
        assert cli.main([*attended, *POLICIES, "--out", str(tmp_path)]) == 1
    finally:
        os.dup2(kept, 0)
        os.close(kept)
        os.close(reading)
    assert "nobody watches the arm" in capsys.readouterr().err
    rows = [json.loads(line) for line in (tmp_path / "point/reach/ledger.jsonl").read_text().splitlines()]
    assert [row["row"] for row in rows] == ["event"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["point/reach", "--robot", "point"], "trials need --out"),
        ([], "trials need task, --robot, --out"),
        (["point/reach", "--robot", "point", "--out", "x"], "no policy to try"),
        (["point/reach", "--robot", "point", "--out", "x", "--policy", "ours"], "write NAME=WHAT"),
        (
            ["point/reach", "--robot", "point", "--out", "x", "--policy", "a=expert"],
            "no expert for point/reach here",
        ),
        (
            [
                "point/reach",
                "--robot",
                "point",
                "--out",
                "x",
                "--policy",
                "a=uniform",
                "--selector",
                "b=hcpg",
            ],
            "no policy is named 'b'",
        ),
        (["--report", "x"], "there are no trials"),
    ],
)
def test_wrong_words_are_named(capsys, monkeypatch, tmp_path, words, told):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["robot", "trials", *words, "--unattended"]) == 2
    assert told in capsys.readouterr().err
