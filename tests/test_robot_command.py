"""`hcpg robot` as a user meets it, on the point arm."""

import json

import pytest

from hcpg import cli
from hcpg.robots.point import LIMITS


def lines(capsys):
    return capsys.readouterr().out.splitlines()


def test_check_shows_the_limits_and_says_ready(capsys, tmp_path):
    out = tmp_path / "check.json"
    assert cli.main(["robot", "check", "point/reach", "--robot", "point", "--out", str(out)]) == 0
    said = lines(capsys)
    assert said[0] == "point (twin), point/reach; limits:"
    assert any(line.split() == ["step_m", str(LIMITS.step_m)] for line in said)
    assert "held for 2 s: 61 ticks, 0 deadlines missed" in said
    assert said[-1] == "ready"
    assert json.loads(out.read_text())["timing"]["ticks"] == 61


def test_run_writes_every_step_and_counts_actions(capsys, tmp_path):
    command = ["robot", "run", "point/reach", "--robot", "point", "--episodes", "2", "--horizon", "5"]
    assert cli.main([*command, "--out", str(tmp_path)]) == 0
    said = lines(capsys)
    assert said[-3:-1] == [
        f"twin: start {start}: time_limit (time_limit), 5 actions, 4 held" for start in (0, 1)
    ]
    rows = [json.loads(line) for line in (tmp_path / "steps.jsonl").read_text().splitlines()]
    assert sum(row["kind"] == "step" for row in rows) == 2 * 9
    assert sum(row["kind"] == "step" and row["executed"] is not None for row in rows) == 2 * 5


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["check", "point/reach", "--robot", "pint"], "no robot is named 'pint'. Did you mean 'point'?"),
        (["check", "point/carry", "--robot", "point"], "no task of an arm is named 'point/carry'"),
        (
            ["drill", "point/reach", "--robot", "point", "--out", "x", "--fault", "reflexes"],
            "Did you mean 'reflex'?",
        ),
        (["run", "point/reach", "--robot", "point", "--out", "x", "--selector", "value"], "needs a critic"),
    ],
)
def test_wrong_words_are_named(capsys, monkeypatch, tmp_path, words, told):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["robot", *words]) == 2
    assert told in capsys.readouterr().err
