"""What a launch starts, leaves alone, takes up again and gives up; nothing is trained here."""

import os
import signal

import pytest
from stand_in_jobs import StandInPlace, create
from tiny_cells import cell

from hcpg.experiments import engine
from hcpg.experiments.claims import claim_of, is_locked, locked
from hcpg.experiments.engine import LOST, Job, Place, run
from hcpg.experiments.ledger import entries


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(engine, "POLL_S", 0.001)


def started(place):
    """Seeds of each job in the order of their starts."""
    return [[each.seed for each in job.unit.cells] for job in place.jobs]


def states(cells, results):
    return [entry.state for entry in entries(cells, results)]


def test_missing_runs_are_made_as_there_is_room_and_a_second_launch_makes_none(tmp_path):
    told, cells, place = [], [cell(seed) for seed in range(3)], StandInPlace(most=2, polls=3)
    assert isinstance(place, Place)
    assert run(cells, tmp_path, place, told.append) == ([], None)
    assert isinstance(place.jobs[0], Job)
    assert started(place) == [[0], [1], [2]]
    assert max(place.at_once) == 2
    assert states(cells, tmp_path) == ["finished"] * 3
    assert told[:3] == [
        "0 of 3 runs are done, 3 are left",
        "point/reach sac s0: started on nowhere",
        "point/reach sac s1: started on nowhere",
    ]
    assert told[3].startswith("point/reach sac s0: finished after 0.0 minutes")
    again, idle = [], StandInPlace()
    assert run(cells, tmp_path, idle, again.append) == ([], None)
    assert (again, idle.jobs) == (["3 of 3 runs are done, 0 are left"], [])


def test_the_seeds_of_a_configuration_are_one_job_where_the_place_says_so(tmp_path):
    place = StandInPlace(together=True)
    run([cell(0), cell(0, steps=128), cell(1), cell(1, steps=128)], tmp_path, place, lambda _: None)
    assert started(place) == [[0, 1], [0, 1]]
    assert [job.unit.settings.budget.steps for job in place.jobs] == [64, 128]


def test_a_diverged_run_is_done_and_a_failed_one_is_named_and_taken_up_by_the_next_launch(tmp_path):
    told, cells, place = [], [cell(0), cell(1), cell(2)], StandInPlace(codes=[1, 3])
    ended = run(cells, tmp_path, place, told.append)
    assert ended == ([cells[0]], None)
    assert states(cells, tmp_path) == ["failed", "diverged", "finished"]
    [line] = [text for text in told if "failed" in text]
    assert line.startswith("point/reach sac s0: failed with exit code 1 after 0.0 minutes")
    assert line.endswith(f"see {tmp_path / 'logs/point-reach_sac_s0.txt'}")
    [failed] = place.jobs[0].folders
    again = StandInPlace()
    assert run(cells, tmp_path, again, lambda _: None) == ([], None)
    assert [job.unit.folders for job in again.jobs] == [[failed.path]]


def test_a_lost_run_goes_on_in_its_folder_before_others_begin(tmp_path):
    told, place = [], StandInPlace(codes=[LOST])
    assert run([cell(0), cell(1)], tmp_path, place, told.append) == ([], None)
    assert started(place) == [[0], [0], [1]]
    assert place.jobs[1].unit.folders == [place.jobs[0].folders[0].path]
    assert "point/reach sac s0: lost with nowhere, goes on elsewhere after 0.0 minutes" in told


def test_a_run_that_loses_three_machines_is_given_up(tmp_path):
    told, place = [], StandInPlace(codes=[LOST] * 9)
    assert run([cell(0)], tmp_path, place, told.append).failed == [cell(0)]
    assert started(place) == [[0]] * 3
    assert "point/reach sac s0: lost with nowhere after 0.0 minutes, see" in told[-1]


def test_a_cell_that_another_launch_has_is_left_to_it_also_in_a_group(tmp_path):
    claim = locked(claim_of(cell(1), tmp_path))
    place = StandInPlace(together=True)
    assert run([cell(0), cell(1), cell(2)], tmp_path, place, lambda _: None) == ([], None)
    assert started(place) == [[0, 2]]
    claim.close()
    assert states([cell(0), cell(1), cell(2)], tmp_path) == ["finished", "left", "finished"]


def test_what_another_launch_has_finished_meanwhile_is_not_begun(tmp_path):
    place = StandInPlace()

    def other_launch(text):
        if "s0: started" in text:
            create(cell(1), tmp_path).set_status("finished")

    run([cell(0), cell(1)], tmp_path, place, other_launch)
    assert started(place) == [[0]]


def test_a_running_job_holds_its_cells_and_lets_go_at_its_end(tmp_path):
    seen = []
    place = StandInPlace(codes=[1])
    run([cell(0)], tmp_path, place, lambda text: seen.append(is_locked(claim_of(cell(0), tmp_path))))
    assert seen == [False, True, False]


@pytest.mark.parametrize(("signals", "stops"), [(1, [False]), (2, [False, True])])
def test_a_signal_lets_the_jobs_save_and_a_second_one_kills_them(signals, stops, tmp_path, monkeypatch):
    told, place = [], StandInPlace(polls=10**6)

    def stopped(job, *, at_once):
        job.stops.append(at_once)
        if len(job.stops) == signals:
            job.code, job.polls = 143, 0
        else:
            os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr("stand_in_jobs.StandInJob.stop", stopped)

    def interrupt(text):
        told.append(text)
        if "started" in text:
            os.kill(os.getpid(), signal.SIGTERM)

    ended = run([cell(0), cell(1)], tmp_path, place, interrupt)
    assert ended == ([], signal.SIGTERM)
    assert [job.stops for job in place.jobs] == [stops]
    assert told[-1].startswith("point/reach sac s0: saved after")
    assert states([cell(0), cell(1)], tmp_path) == ["stopped", "left"]


def test_a_launch_without_room_waits_and_says_so_once(tmp_path):
    told, place = [], StandInPlace(most=0)
    looks = []

    def room():
        looks.append(None)
        return len(looks) > 5

    place.room = room
    assert run([cell(0)], tmp_path, place, told.append) == ([], None)
    assert told[1] == "no room at present; waiting for a place to get free"
    assert told[2] == "point/reach sac s0: started on nowhere"
