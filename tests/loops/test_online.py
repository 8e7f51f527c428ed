"""A budget on an arm: spent in executed actions, whoever selects; taken up again without a loss."""

import json
from dataclasses import replace

import jax
import numpy as np
import pytest
from point_rig import new_rig

from hcpg.experiments import arm_budgets
from hcpg.loops import checkpoints, online, online_learner, sitting
from hcpg.loops.control.experience import Experience
from hcpg.loops.demonstrations import Demonstrations
from hcpg.loops.learner_process import Word
from hcpg.loops.online import OnlineRun
from hcpg.loops.online_learner import OnlineLearner
from hcpg.loops.runs import RunFolder
from hcpg.safety.faults import FaultyRobot
from hcpg.types import Batch

BUDGET, PER_ACTION = 70, 4
"""Episodes of the point arm have 60 actions at most, so the second one is cut."""


def settings(preset="hcpg_flow"):
    full = arm_budgets.settings("point/reach", preset, BUDGET, PER_ACTION)
    sizes = {name: 8 for name in vars(full.learner) if name.endswith("hidden_size")}
    budget = replace(full.budget, batch_size=16)
    return replace(full, learner=replace(full.learner, flow_steps=2, imitation=0.0, **sizes), budget=budget)


def shown(folder):
    generator = np.random.default_rng(1)
    rows = [generator.normal(size=(64, 11)), generator.uniform(-1, 1, (64, 4)), np.zeros(64)]
    rows += [rows[0], np.zeros(64)]
    return Demonstrations(folder, {"sha256": "abc"}, Batch(*(each.astype(np.float32) for each in rows)))


class Inline:
    """The learner's process without a process: it has learned as soon as it is asked."""

    def __init__(self, run, demos, task, log):
        self.learner = OnlineLearner(RunFolder.open(run), shown(demos))
        self.words = [Word(self.learner.progress, {})]

    def alive(self):
        return True

    def give(self, episode):
        self.words.append(Word(self.learner.take_in(episode), self.learner.told[-1]))

    def word(self, stop):
        return self.words.pop(0) if self.words else None

    def close(self):
        pass


class KilledError(Exception):
    """The end of the program, in the middle of an action."""


@pytest.fixture(autouse=True)
def inline(monkeypatch):
    monkeypatch.setattr(online, "LearnerProcess", Inline)


def begun(root, preset="hcpg_flow"):
    """A run with fresh networks in the place of a clone."""
    chosen = settings(preset)
    [folder] = sitting.create_folders(chosen, [5], root)
    spec = sitting.registry.suite("point").spec(sitting.registry.task("point/reach"))
    method = sitting.registry.method("sac_flow").METHOD(chosen.learner, spec)
    online_learner.begin(folder, jax.jit(method.init)(jax.random.key(0)), spec)
    facts = {"first_start": online.first_start(5), "demonstrations": {"path": str(root), "sha256": "abc"}}
    (folder.path / online.FACTS).write_text(json.dumps(facts))
    return folder


def run(folder, rig=None, kill_at=None, strike_at=None, robot=None):
    """One sitting; killed at its proposal number `kill_at`, or its robot struck at number `strike_at`."""
    sitting_of = OnlineRun(folder, rig or new_rig(), lambda line: None)
    policy, asked = sitting_of._policy, []

    def counted(observation, count, draw):
        asked.append(draw)
        if len(asked) - 1 == kill_at:
            raise KilledError
        if len(asked) - 1 == strike_at:
            robot.strike("reflex")
        return policy(observation, count, draw)

    counted.load = policy.load
    sitting_of._policy = counted
    return sitting_of.run()


def executed_in_logs(folder):
    """Every action that any sitting's log has, in order."""
    lines = [
        line for log in sorted(folder.path.glob("steps_*.jsonl")) for line in log.read_text().splitlines()
    ]
    rows = [row for row in map(json.loads, lines) if row["kind"] == "step" and row["executed"] is not None]
    return [row["executed"] for row in rows]


def newest(folder):
    path = checkpoints.latest(folder.checkpoints)
    return online_learner.progress_of(folder), checkpoints.load_raw(path, "online")


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A whole run of each method."""
    patch = pytest.MonkeyPatch()
    patch.setattr(online, "LearnerProcess", Inline)
    folders = {preset: begun(tmp_path_factory.mktemp(preset), preset) for preset in ("hcpg_flow", "sac_flow")}
    done = {preset: run(folder) for preset, folder in folders.items()}
    patch.undo()
    return folders, done


@pytest.mark.parametrize("preset", ["hcpg_flow", "sac_flow"])
def test_the_budget_is_spent_to_the_action_and_updates_follow_from_it(both, preset):
    folder, done = both[0][preset], both[1][preset]
    assert sum(each.actions for each in done.episodes) == BUDGET == len(executed_in_logs(folder))
    progress, kept = newest(folder)
    assert (progress.executed, progress.updates) == (BUDGET, BUDGET * PER_ACTION)
    assert len(kept["['rewards']"]) == BUDGET
    assert folder.status()["state"] == "finished"


def test_the_methods_differ_in_the_selector_alone(both):
    one, other = (both[0][preset].config() for preset in ("hcpg_flow", "sac_flow"))
    different = {name for name in one if one[name] != other[name]}
    assert different == {"preset", "selector", "evaluation_selector"}
    starts = [[each.start for each in both[1][preset].episodes] for preset in ("hcpg_flow", "sac_flow")]
    shortest = min(map(len, starts))
    assert starts[0][:shortest] == starts[1][:shortest] == [1_050_000 + n for n in range(shortest)]


def test_spread_and_entropy_of_the_weights_are_written_down(both):
    rows = both[0]["hcpg_flow"].rows("metrics")
    assert [row["updates"] for row in rows] == [PER_ACTION * row["step"] for row in rows]
    assert all(0.0 < row["selector_weight_entropy"] < np.log(4) for row in rows)
    assert all(row["selector_spread"] > 0.0 and row["actor_spread"] > 0.0 for row in rows)
    alone = both[0]["sac_flow"].rows("metrics")
    assert all(row["selector_spread"] == row["selector_weight_entropy"] == 0.0 for row in alone)
    assert all(row["actor_spread"] > 0.0 for row in alone)


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """A run killed in the middle of its first episode; taken up again, it meets a reflex at once."""
    patch = pytest.MonkeyPatch()
    patch.setattr(online, "LearnerProcess", Inline)
    folder, rig = begun(tmp_path_factory.mktemp("broken")), new_rig()
    with pytest.raises(KilledError):
        run(folder, kill_at=25)
    first = newest(folder)[0].executed, len(executed_in_logs(folder))
    robot = FaultyRobot(rig.robot)
    done = run(folder, rig._replace(robot=robot), strike_at=10, robot=robot)
    patch.undo()
    return folder, first, done


def test_a_kill_in_the_middle_of_an_episode_loses_nothing_and_refunds_nothing(broken):
    folder, first, done = broken
    assert first == (0, 25)  # no checkpoint has the 25 actions of the episode that did not end; the log has
    assert sum(each.actions for each in done.episodes) == BUDGET - 25
    assert len(executed_in_logs(folder)) == BUDGET
    progress, kept = newest(folder)
    assert (progress.executed, progress.updates) == (BUDGET, BUDGET * PER_ACTION)
    np.testing.assert_array_equal(kept["['actions']"], np.asarray(executed_in_logs(folder), np.float32))
    lost = folder.rows("episodes")[0]
    assert (lost["start"], lost["length"], lost["ended"]) == (1_050_000, 25, "lost")
    assert done.episodes[0].start == 1_050_001  # an episode's start state is not given twice


def test_a_fault_is_charged_and_not_refunded(broken):
    folder, _, done = broken
    fault = folder.rows("episodes")[1]
    assert (fault["ended"], fault["length"]) == ("fault", done.episodes[0].actions)
    assert 10 <= done.episodes[0].actions <= 11


def test_an_episode_without_a_seen_outcome_earns_its_updates_later(tmp_path):
    folder = begun(tmp_path)
    learner = OnlineLearner(folder, shown(tmp_path))
    empty = Batch(*(np.zeros((0, *each.shape[1:]), np.float32) for each in shown(tmp_path).batch))
    progress = learner.take_in(Experience(0, 9, "lost", 1, empty, {}))
    assert (progress.executed, progress.updates) == (1, 0)
    rows = Batch(*(each[:3] for each in shown(tmp_path).batch))
    progress = learner.take_in(Experience(1, 10, "fault", 3, rows, {}))
    assert (progress.executed, progress.updates, progress.episodes) == (4, 16, 2)
