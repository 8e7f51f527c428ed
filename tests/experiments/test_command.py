"""`hcpg experiment` on the command line."""

import os

import pytest
from stand_in_jobs import StandInPlace, create
from tiny_cells import cell

from hcpg import cli
from hcpg.commands import experiment
from hcpg.experiments import engine, protocols, slots
from hcpg.experiments.claims import claim_of, locked
from hcpg.experiments.protocols import Protocol
from hcpg.loops import machine

CORES = sorted(os.sched_getaffinity(0))


@pytest.fixture
def small(monkeypatch):
    each = Protocol("A small one", ("point/reach",), ("sac", "qsm"), seeds=(0, 1))
    monkeypatch.setitem(protocols.PROTOCOLS, "small", each)
    return each


@pytest.fixture
def stand_in(monkeypatch):
    """Jobs that train nothing, and a report that only says what it was asked for."""
    place = StandInPlace()
    monkeypatch.setattr(engine, "POLL_S", 0.001)
    monkeypatch.setattr(experiment, "_place", lambda options: place)
    monkeypatch.setattr(experiment.report, "run", lambda words: place.asked.append(words) or 0)
    place.asked = []
    return place


def test_the_list_names_every_experiment_with_its_size(small, capsys):
    assert cli.main(["experiment", "list"]) == 0
    assert "\nsmall                     A small one: 4 runs, budget cpu\n" in capsys.readouterr().out


def test_the_status_has_a_line_per_task_and_preset(small, tmp_path, capsys):
    assert cli.main(["experiment", "status", "small", "--out", str(tmp_path), "--cores", "1"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "point/reach sac  s0 left, s1 left",
        "point/reach qsm  s0 left, s1 left",
        "4 left, time left unknown before a run has learned for a while",
    ]


def test_the_status_tells_done_running_failed_and_left_and_the_time_at_the_present_pace(
    small, tmp_path, capsys
):
    cells = small.cells()
    steps, results = cells[0].settings.budget.steps, tmp_path / "small"
    for each, state, step in ((cells[0], "finished", steps), (cells[1], "failed", steps // 4)):
        folder = create(each, results)
        folder.append("metrics", [{"step": step, "wall_s": 7200.0 * step / steps}])
        folder.set_status(state)
    claim = locked(claim_of(cells[2], results))
    assert cli.main(["experiment", "status", "small", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "point/reach sac  s0 finished, s1 running",
        "point/reach qsm  s0 failed at 25 %, s1 left",
        # 2 hours a run, at one at a time: three quarters of one and two whole ones.
        "1 finished, 1 failed, 1 running, 1 left, about 5.5 hours left, 1 at a time",
    ]
    claim.close()


def test_less_than_an_hour_is_told_in_minutes(small, tmp_path, capsys):
    cells = small.cells()
    steps = cells[0].settings.budget.steps
    for each in cells[:3]:
        folder = create(each, tmp_path / "small")
        folder.append("metrics", [{"step": steps, "wall_s": 720.0}])
        folder.set_status("finished")
    assert cli.main(["experiment", "status", "small", "--out", str(tmp_path), "--cores", "1"]) == 0
    assert (
        capsys.readouterr().out.splitlines()[-1] == "3 finished, 1 left, about 12 minutes left, 1 at a time"
    )


def test_a_complete_experiment_is_reported_and_other_seeds_can_be_asked_for(
    small, stand_in, tmp_path, capsys
):
    words = ["experiment", "run", "small", "--out", str(tmp_path), "--seeds", "7", "8", "7"]
    assert cli.main(words) == 0
    assert [job.unit.cells[0].seed for job in stand_in.jobs] == [7, 7, 8, 8]
    assert stand_in.asked == [[str(tmp_path / "small")]]
    assert capsys.readouterr().out.splitlines()[-1] == "4 finished"
    assert cli.main([*words, "--no-report"]) == 0
    assert (len(stand_in.jobs), len(stand_in.asked)) == (4, 1)


def test_a_part_can_be_run_and_only_the_whole_is_reported(small, stand_in, tmp_path, capsys):
    words = ["experiment", "run", "small", "--out", str(tmp_path), "--tasks", "point/reach"]
    assert cli.main([*words, "--presets", "qsm"]) == 0
    assert [job.unit.cells[0].settings.preset for job in stand_in.jobs] == ["qsm", "qsm"]
    assert stand_in.asked == []
    capsys.readouterr()
    assert cli.main(["experiment", "status", *words[2:], "--presets", "qsm"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "2 finished"
    stand_in.most = 1  # the first run closed it
    assert cli.main(words) == 0
    assert (len(stand_in.jobs), stand_in.asked) == (4, [[str(tmp_path / "small")]])


def test_a_preset_that_the_table_lacks_is_refused_with_those_it_has(small, stand_in, tmp_path, capsys):
    words = ["experiment", "run", "small", "--out", str(tmp_path), "--presets", "sac_flow"]
    assert cli.main(words) == 2
    message = "no preset of this experiment is named 'sac_flow'. Known: sac, qsm."
    assert message in capsys.readouterr().err
    assert stand_in.jobs == []


def test_an_experiment_with_a_failed_run_is_not_reported(small, stand_in, tmp_path, capsys):
    stand_in.codes = [1]
    assert cli.main(["experiment", "run", "small", "--out", str(tmp_path)]) == 1
    assert stand_in.asked == []
    assert "1 failed, 3 finished" in capsys.readouterr().out


def test_a_task_that_is_not_there_is_found_before_anything_starts(
    small, stand_in, tmp_path, monkeypatch, capsys
):
    other = Protocol("Of a task to come", ("point/reach", "point/reech"), ("sac",))
    monkeypatch.setitem(protocols.PROTOCOLS, "other", other)
    assert cli.main(["experiment", "run", "other", "--out", str(tmp_path)]) == 2
    assert "no task is named 'point/reech'. Did you mean 'point/reach'?" in capsys.readouterr().err
    assert stand_in.jobs == []


def test_a_wrong_name_too_many_cores_and_more_than_a_card_are_refused(small, capsys):
    assert cli.main(["experiment", "run", "smal"]) == 2
    assert "Did you mean 'small'?" in capsys.readouterr().err
    for words, message in (
        (["small", "--cores", "99"], "--cores 99: this process may use 1 to"),
        (["small", "--gpus-per-job", "1.5"], "--gpus-per-job 1.5: a share of one card, from 0 (none) to 1"),
        (["small", "--cores-per-job", "0"], "--cores-per-job 0: a job needs at least one"),
        ([], "name an experiment: smoke"),
    ):
        with pytest.raises(SystemExit):
            cli.main(["experiment", "run", *words])
        assert message in capsys.readouterr().err


def place(*words):
    options = experiment._parser().parse_args(["run", "small", *words])
    options.cores = CORES
    found = experiment._place(options)
    return [slot.name for slot in found._slots], found.together


def test_without_an_accelerator_jobs_go_onto_cores_and_with_one_onto_cards(monkeypatch):
    cores = [f"core {core}" for core in CORES]
    monkeypatch.setattr(machine, "has_accelerator", lambda: False)
    monkeypatch.setattr(slots, "cards", lambda: ["0"])
    assert place() == (cores, False)
    monkeypatch.setattr(machine, "has_accelerator", lambda: True)
    assert place() == (["card 0"], True)
    assert place("--gpus-per-job", "0.5") == (["card 0 part 0", "card 0 part 1"], True)
    assert place("--gpus-per-job", "0") == (cores, False)


def test_a_cell_has_the_identity_of_its_settings_and_seed():
    assert cell(0).identity() == cell(0).identity()
    assert len({cell(0).identity(), cell(1).identity(), cell(0, steps=128).identity()}) == 3
