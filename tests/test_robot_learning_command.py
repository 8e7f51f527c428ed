"""`hcpg robot demos | clone | learn` as a user meets them, before anything is learned."""

import json
import os

import pytest

from hcpg import cli

DEMOS = ["robot", "demos", "franka/drawer-closing", "--robot", "twin"]


@pytest.fixture
def no_terminal(monkeypatch):
    """Standard input is a pipe."""
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        monkeypatch.setattr("sys.stdin", stream)
        yield
    os.close(writing)


def test_demonstrations_of_the_twin_are_stored_and_told(capsys, tmp_path):
    out = tmp_path / "demos"
    command = ["robot", "demos", "franka/button-press", "--robot", "twin", "--count", "1", "--out", str(out)]
    assert cli.main(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-2:] == ["twin: 1 of 1 episodes succeeded and are kept", f"demonstrations in {out}"]
    manifest = json.loads((out / "manifest.json").read_text())
    assert (manifest["task"], manifest["kind"]) == ("franka/button-press", "twin")
    assert manifest["episodes"][0]["actions"] > 50.0  # an expert at full speed needs 50


def test_a_keyboard_without_a_terminal_is_refused(capsys, tmp_path, no_terminal):
    assert cli.main([*DEMOS, "--source", "keyboard", "--out", str(tmp_path / "none")]) == 2
    assert "the keyboard needs a terminal, and standard input is none" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_a_gamepad_that_is_not_there_is_refused(capsys, tmp_path):
    words = ["--source", "gamepad", "--device", str(tmp_path / "js9"), "--out", str(tmp_path / "none")]
    assert cli.main([*DEMOS, *words]) == 2
    assert "no gamepad can be read at" in capsys.readouterr().err


def test_a_folder_without_demonstrations_is_refused(capsys, tmp_path):
    assert cli.main(["robot", "clone", str(tmp_path)]) == 2
    assert "holds no demonstrations (it has no manifest.json)" in capsys.readouterr().err


def test_learning_needs_something_to_begin_with(capsys):
    assert cli.main(["robot", "learn", "franka/drawer-closing", "--robot", "twin", "--demos", "x"]) == 2
    assert "give --initial and --demos for a new run, or --resume RUN" in capsys.readouterr().err
