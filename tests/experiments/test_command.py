"""`hcpg experiment` on the command line."""

import pytest

from hcpg import cli
from hcpg.experiments import protocols
from hcpg.experiments.protocols import Protocol


@pytest.fixture
def small(monkeypatch):
    each = Protocol("A small one", ("point/reach",), ("sac", "qsm"), seeds=(0, 1))
    monkeypatch.setitem(protocols.PROTOCOLS, "small", each)


def test_the_list_names_every_experiment_with_its_size(small, capsys):
    assert cli.main(["experiment", "list"]) == 0
    assert "\nsmall                     A small one: 4 runs, budget cpu\n" in capsys.readouterr().out


def test_the_status_has_a_line_per_task_and_preset(small, tmp_path, capsys):
    assert cli.main(["experiment", "status", "small", "--out", str(tmp_path), "--cores", "1"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "point/reach sac  s0 left, s1 left",
        "point/reach qsm  s0 left, s1 left",
        "4 left, time left unknown before a run has finished",
    ]


def test_a_wrong_name_and_too_many_cores_are_refused(small, capsys):
    assert cli.main(["experiment", "run", "smal"]) == 2
    assert "Did you mean 'small'?" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main(["experiment", "run", "small", "--cores", "99"])
    assert "--cores 99: this process may use 1 to" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main(["experiment", "run"])
    assert "name an experiment: smoke" in capsys.readouterr().err
