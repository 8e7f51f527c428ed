"""What is written down: means, counts of success, and the last word about every run."""

import numpy as np
import pytest

from hcpg.loops.journal import Journal
from hcpg.loops.runs import RunFolder


@pytest.fixture
def folders(tmp_path):
    common = {"task": "point/reach", "preset": "hcpg_flow", "config": {}, "manifest": {}}
    return [RunFolder.create(tmp_path, seed=seed, **common) for seed in (0, 1)]


@pytest.fixture
def events():
    return []


@pytest.fixture
def journal(folders, events):
    return Journal(folders, [0, 1], {"adapter": "paper"}, events.append)


def episode(success):
    return {"success_once": success, "return": 1.0}


def test_a_row_has_the_means_over_time_of_what_was_reported(journal, folders):
    journal.metrics({"loss": np.array([1.0, 10.0]), "delayed": np.array([np.nan, np.nan])})
    journal.metrics({"loss": np.array([3.0, np.nan]), "delayed": np.array([5.0, np.nan])})
    journal.row(step=40, updates=7, wall_s=2.5)
    [first], [second] = (folder.rows("metrics") for folder in folders)
    assert (first["step"], first["updates"], first["wall_s"]) == (40, 7, 2.5)
    assert (first["loss"], first["delayed"]) == (2.0, 5.0)
    assert second["loss"] == 10.0
    assert "delayed" not in second  # nobody reported it for that run


def test_a_row_forgets_what_the_last_one_told(journal, folders):
    journal.metrics({"loss": np.array([1.0, 1.0])})
    journal.row(10, 1, 1.0)
    journal.metrics({"loss": np.array([5.0, 5.0])})
    journal.row(20, 2, 2.0)
    assert [row["loss"] for row in folders[0].rows("metrics")] == [1.0, 5.0]


def test_a_metric_that_is_infinite_is_left_out_of_the_row(journal, folders):
    journal.metrics({"loss": np.array([np.inf, 1.0])})
    journal.row(10, 1, 1.0)
    assert "loss" not in folders[0].rows("metrics")[0]
    assert folders[1].rows("metrics")[0]["loss"] == 1.0


def test_training_success_is_that_of_the_last_twenty_episodes(journal, folders, events):
    journal.episodes(10, 0, [episode(False)] * 10)
    journal.episodes(20, 0, [episode(True)] * 15)  # of the last twenty 15 succeeded
    journal.row(20, 1, 1.0)
    assert folders[0].rows("metrics")[0]["train_success"] == 0.75
    assert "train_success" not in folders[1].rows("metrics")[0]
    assert [(event.kind, event.seed) for event in events] == [("progress", 0), ("progress", 1)]
    first = folders[0].rows("episodes")[0]
    assert first == {"step": 10, "phase": "train", "adapter": "paper", "success_once": False, "return": 1.0}
    assert len(folders[0].rows("episodes")) == 25


def test_an_evaluation_is_told_as_counts_by_selector(journal, folders, events):
    rows = [{"step": 5, "selector": name, "success_once": won} for name, won in
            [("hcpg", True), ("hcpg", True), ("bare", False), ("bare", True)]]  # fmt: skip
    journal.evaluation(5, [rows, rows[:2]])
    assert events[0].facts == {"step": 5, "successes": {"hcpg": [2, 2], "bare": [1, 2]}}
    assert events[1].facts["successes"] == {"hcpg": [2, 2]}
    assert [len(folder.rows("episodes")) for folder in folders] == [4, 2]


def test_a_diverged_run_is_closed_and_the_other_finishes(journal, folders, events):
    journal.diverged(0, step=30, quantity="state.critic")
    journal.metrics({"loss": np.array([np.nan, 2.0])})
    journal.row(40, 1, 1.0)
    journal.episodes(40, 0, [episode(True)])
    journal.ended("finished", 50)
    assert journal.alive == [False, True]
    first, second = (folder.status() for folder in folders)
    assert (first["state"], first["step"], first["quantity"]) == ("diverged", 30, "state.critic")
    assert (second["state"], second["step"]) == ("finished", 50)
    assert folders[0].rows("metrics") == folders[0].rows("episodes") == []
    kinds = [(event.kind, event.seed) for event in events]
    assert kinds == [("diverged", 0), ("progress", 1), ("finished", 1)]
