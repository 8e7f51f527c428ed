"""`hcpg export` as a user meets it, and what it wrote at the point arm's side."""

import json

import numpy as np
import pytest
from exported_runs import a_run

from hcpg import cli
from hcpg.commands import choice
from hcpg.loops.control.deployed import Policy


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return a_run(tmp_path_factory.mktemp("run"), actor_hidden_size=8, critic_hidden_size=8).folder.path


@pytest.fixture
def exported(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(choice, "prepare", lambda: None)  # it would set this process up anew
    out = tmp_path / "policy"
    assert cli.main(["export", str(folder), "--out", str(out), "--time", "0.1"]) == 0
    return out


def test_it_says_where_what_how_exact_and_how_fast(capsys, exported):
    where, what, exact, digest, fast, late = capsys.readouterr().out.splitlines()
    policy = Policy.load(exported)
    assert where == str(exported)
    assert what == "point/reach, adapter paper, gated network, hcpg (K = 4)"
    assert exact == f"at most {policy.deviation:.1e} from what the trained network did (allowed: 1e-05)"
    assert digest == f"sha256 {policy.digest}"
    assert fast.startswith("4 actions at 30 Hz: p50 ")
    assert late.endswith(" deadlines missed")


def test_the_point_arm_runs_it(exported, capsys, tmp_path):
    command = ["robot", "run", "point/reach", "--robot", "point", "--policy", str(exported), "--horizon", "5"]
    assert cli.main([*command, "--out", str(tmp_path / "run")]) == 0
    rows = [json.loads(line) for line in (tmp_path / "run/steps.jsonl").read_text().splitlines()]
    chosen = [row for row in rows if row["kind"] == "step" and row["choice"] is not None]
    assert len(chosen) == 5
    policy = Policy.load(exported)
    for row in chosen:
        again = policy.proposer(0)(np.array(row["observation"], np.float32), 4, row["tick"]["number"])
        assert row["choice"]["proposals"] == pytest.approx(again, abs=1e-6)


def test_another_tasks_policy_is_refused(exported, capsys, tmp_path):
    command = ["robot", "run", "franka/button-press", "--robot", "twin", "--policy", str(exported)]
    assert cli.main([*command, "--out", str(tmp_path / "run")]) == 2
    assert "is one for point/reach, not for franka/button-press" in capsys.readouterr().err
