"""Runs side by side in processes: each ends in its own way, and none disturbs the others."""

import os
import signal
from pathlib import Path

import pytest
from tiny_runs import checkpoint_digests, tiny_settings

from hcpg.loops import population
from hcpg.loops.child import Job
from hcpg.loops.runs import RunFolder

LONG = 20_000


class Saboteur:
    """A view that sends a signal to a run's process once it trains."""

    def __init__(self, signals):
        self.signals, self.news, self.folders = dict(signals), [], {}

    def tell(self, lane, message):
        self.news.append((lane.seed, message.kind))
        if message.kind == "opened":
            self.folders[lane.seed] = Path(message.facts["folder"])
        if message.kind == "progress" and lane.seed in self.signals:
            process = int((self.folders[lane.seed] / "lock").read_text())
            os.kill(process, self.signals.pop(lane.seed))

    def say(self, text):
        self.news.append((None, text))

    def beat(self):
        pass


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Seed 1 in peace, 2 with an absurd learning rate, 3 killed, 4 asked to stop."""
    root = tmp_path_factory.mktemp("population")
    jobs = [
        Job(tiny_settings().as_json(), [1], root, []),
        Job(tiny_settings(critic_learning_rate=1e30).as_json(), [2], root, []),
        Job(tiny_settings(steps=LONG).as_json(), [3, 4], root, []),
    ]
    view = Saboteur({3: signal.SIGKILL, 4: signal.SIGTERM})
    found = population.train(jobs, view, accelerated=False)
    return {outcome.lane.seed: outcome for outcome in found.outcomes}, view, found.signal


def test_every_run_ends_in_its_own_way(ended):
    outcomes, _, stopped_by = ended
    states = {seed: outcome.state for seed, outcome in outcomes.items()}
    assert states == {1: "finished", 2: "diverged", 3: "failed", 4: "stopped"}
    for outcome in outcomes.values():
        assert RunFolder.open(outcome.folder).status()["state"] == outcome.state
    assert stopped_by is None


def test_a_run_in_a_process_of_its_own_equals_the_one_trained_here(ended, straight):
    outcomes, _, _ = ended
    assert checkpoint_digests(RunFolder.open(outcomes[1].folder)) == checkpoint_digests(straight[0])


def test_a_diverged_run_is_told_with_step_and_quantity(ended):
    outcomes, view, _ = ended
    assert outcomes[2].facts["quantity"].startswith("state.critic")
    # The warm-up ends at step 40, and the first update follows at once.
    assert 40 < outcomes[2].facts["step"] <= 60
    assert view.news.count((2, "diverged")) == 1


def test_a_killed_run_is_told_with_its_signal(ended):
    outcomes, view, _ = ended
    assert outcomes[3].facts["error"].startswith("its process died with signal 9 (SIGKILL)")
    assert str(outcomes[3].folder / "log.txt") in outcomes[3].facts["error"]
    assert view.news.count((3, "failed")) == 1


def test_a_run_asked_to_stop_saves_where_it_is(ended):
    outcomes, _, _ = ended
    step = outcomes[4].facts["step"]
    assert 0 < step < LONG
    assert (outcomes[4].folder / "checkpoints" / f"step_{step:09d}" / "facts.json").exists()


def test_an_error_before_the_folder_is_there_is_told(tmp_path):
    config = tiny_settings().as_json() | {"method": "sac_folw"}
    view = Saboteur({})
    [outcome] = population.train([Job(config, [0], tmp_path, [])], view, accelerated=False).outcomes
    assert (outcome.state, outcome.folder) == ("failed", None)
    assert "Did you mean 'sac_flow'?" in outcome.facts["error"]
