"""One short training on the point suite: what the replay holds, and that a resume goes on bit for bit."""

import json
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
import pytest

from hcpg import presets, registry
from hcpg.loops import checkpoints, replay, streams
from hcpg.loops.checkpoints import CheckpointError
from hcpg.loops.journal import Journal
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import take
from hcpg.loops.saving import Saver, load_state, restore
from hcpg.loops.training import Trainer

SEEDS, ENVIRONMENTS, HORIZON = [0, 7], 2, 60
TICKS = 70
"""One whole episode, and ten steps of the next: past the time limit and past the warm-up."""
CAPACITY = 130
"""Less than the 140 transitions of a run: the ring has wrapped around."""


def settings():
    chosen = presets.settings("point/carry", "hcpg_flow", "cpu")
    learner = replace(chosen.learner, actor_hidden_size=8, critic_hidden_size=8)
    amount = presets.Budget(
        "test",
        steps=1000,
        environments=ENVIRONMENTS,
        updates_per_step=0.5,
        warmup_steps=40,
        batch_size=8,
        evaluations=1,
        evaluation_episodes=1,
        replay_capacity=CAPACITY,
    )
    return replace(chosen, learner=learner, budget=amount)


class Saved(NamedTuple):
    """A population stopped after `TICKS`, what it saved, and what its next tick brought."""

    folders: list
    position: object
    next_position: object


def train_to(trainer, pool, position, tick, save):
    """Train until `tick`; the trainer asks before every tick whether to stop."""
    left = iter([False] * (tick - position.tick) + [True])
    return trainer.train(pool, position, save, lambda: next(left))


def copied(position):
    """The position as it is now: the trainer gives its arrays away with the next tick."""
    return jax.tree.map(np.array, position)


def trainer_for(folders):
    return Trainer(settings(), SEEDS, Journal(folders, SEEDS, {}, lambda event: None), workers=1)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    config = settings().as_json()
    address = {"task": "point/carry", "preset": "hcpg_flow", "config": config, "manifest": {}}
    folders = [RunFolder.create(root, seed=seed, **address) for seed in SEEDS]
    trainer = trainer_for(folders)
    with trainer.pool() as pool:
        position = train_to(trainer, pool, trainer.fresh(pool), TICKS, Saver(trainer, folders))
        kept = copied(position)
        for folder in folders:
            folder.append("metrics", [{"step": 2 * TICKS}, {"step": 2 * TICKS + 2}])
        following = train_to(trainer, pool, position, TICKS + 1, lambda position: None)
    return Saved(folders, kept, copied(following))


def rows_of(position, run):
    """A run's transitions in the order of their arrival, [ticks, environments, ...], the oldest lost."""
    part = replay.filled_part(position.replay, run)
    shift = -(2 * TICKS % CAPACITY)
    turned = {name: np.roll(rows, shift, axis=0) for name, rows in part.items()}
    return {name: rows.reshape(-1, ENVIRONMENTS, *rows.shape[1:]) for name, rows in turned.items()}


@pytest.mark.parametrize("run", [0, 1])
def test_a_stored_action_is_what_the_environment_received(saved, run):
    """Each row again from its own episode's start: the stored actions lead to the stored observations."""
    rows, lost = rows_of(saved.position, run), TICKS - CAPACITY // ENVIRONMENTS
    task = registry.task("point/carry")
    for index in range(ENVIRONMENTS):
        environment = registry.suite("point").make(task, SEEDS[run])
        start = streams.start_states(SEEDS[run], np.array([1, 1]))[index]  # the second episode
        expected = environment.reset(int(start))
        for tick in range(HORIZON, TICKS):
            np.testing.assert_array_equal(rows["observations"][tick - lost, index], expected)
            step = environment.step(rows["actions"][tick - lost, index])
            expected = step.observation
            np.testing.assert_array_equal(rows["next_observations"][tick - lost, index], expected)
            np.testing.assert_allclose(rows["rewards"][tick - lost, index], step.reward, rtol=1e-6)
    assert float(np.abs(rows["actions"]).max()) <= 1.0


def test_an_episode_has_as_many_rows_as_steps_and_its_last_one_bootstraps(saved):
    """The last row's next observation is one step on, not the next episode's first."""
    for run in (0, 1):
        rows, lost = rows_of(saved.position, run), TICKS - CAPACITY // ENVIRONMENTS
        last = HORIZON - 1 - lost
        assert not rows["terminated"].any()
        tools = rows["observations"][..., :3], rows["next_observations"][..., :3]
        strides = np.abs(tools[1] - tools[0]).max(axis=(1, 2))
        assert strides.max() <= 0.02 + 1e-6
        jumps = np.abs(tools[0][1:] - tools[1][:-1]).max(axis=(1, 2)) > 0
        assert np.flatnonzero(jumps).tolist() == [last]
    assert saved.position.episodes.length.tolist() == [TICKS - HORIZON] * 4
    assert saved.position.episodes.number.tolist() == [1] * 4


def test_warm_up_actions_come_before_the_selectors(saved):
    """Learning starts at tick 20: one update per tick from there on."""
    assert int(saved.position.states.updates) == TICKS - 20
    assert int(saved.next_position.states.updates) == TICKS - 19
    assert int(saved.position.replay.inserted) == 2 * TICKS


@pytest.fixture(scope="module")
def restored(saved):
    """A new trainer and new simulators, from the files alone; and its next tick."""
    trainer = trainer_for(saved.folders)
    with trainer.pool() as pool:
        position = restore(trainer, saved.folders, pool)
        kept = copied(position)
        following = train_to(trainer, pool, position, TICKS + 1, lambda position: None)
        return kept, copied(following)


def assert_same_bits(one, other):
    for (path, left), right in zip(
        jax.tree_util.tree_leaves_with_path(one), jax.tree.leaves(other), strict=True
    ):
        np.testing.assert_array_equal(left, right, err_msg=jax.tree_util.keystr(path))


def test_the_restored_position_is_the_saved_one_bit_for_bit(saved, restored):
    assert_same_bits(restored[0], saved.position)


def test_the_next_tick_after_a_restore_is_the_same_bit_for_bit(saved, restored):
    later, expected = (each._replace(wall_s=0.0) for each in (restored[1], saved.next_position))
    assert_same_bits(later, expected)
    assert not np.array_equal(expected.observations, saved.position.observations)


def test_rows_written_after_the_checkpoint_are_dropped(saved, restored):
    assert [row["step"] for row in saved.folders[0].rows("metrics")][-1] == 2 * TICKS


def test_a_saved_state_can_be_loaded_without_a_simulator(saved):
    template = jax.tree.map(np.zeros_like, take(saved.position.states, 1))
    state, step = load_state(saved.folders[1], template)
    assert step == 2 * TICKS
    assert int(state.updates) == TICKS - 20
    np.testing.assert_array_equal(state.log_temperature, saved.position.states.log_temperature[1])


def test_a_checkpoint_that_is_not_there_is_told_with_those_that_are(saved):
    with pytest.raises(CheckpointError, match=r"no checkpoint at step 3\. There are: step_000000140"):
        load_state(saved.folders[0], None, step=3)


def test_the_replay_is_saved_only_as_far_as_it_is_filled(saved):
    path = checkpoints.latest(saved.folders[0].checkpoints)
    raw = checkpoints.load_raw(path, "replay")
    assert {rows.shape[0] for rows in raw.values()} == {CAPACITY}
    facts = json.loads((path / "facts.json").read_text())["facts"]
    assert (facts["tick"], facts["inserted"]) == (TICKS, 2 * TICKS)
