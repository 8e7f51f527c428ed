"""A step of ours, on a model that all environments of a task share, is the package's bit for bit."""

import gc

import numpy as np
import pytest
from trajectories import actions_of, trajectory

from hcpg import registry
from hcpg.experiments.protocols import METAWORLD
from hcpg.suites import metaworld as suite
from hcpg.suites.metaworld import shared_model

ALL = sorted(suite._metaworld().ALL_V3_ENVIRONMENTS)


def stock(env_id):
    """The package's own class."""
    return suite._metaworld().ALL_V3_ENVIRONMENTS[env_id]


def rows_of(simulation, actions):
    """What an episode gives at the reset and at every step."""
    observations = [simulation.reset()[0]]
    others = []
    for action in actions:
        observation, reward, terminated, truncated, info = simulation.step(action)
        observations.append(observation)
        others.append([reward, terminated, truncated, *info.values()])
    return np.asarray(observations), np.asarray(others, np.float64)


@pytest.mark.parametrize("env_id", ALL)
def test_every_step_is_the_packages_and_an_episode_moves_nothing_but_places(env_id):
    ours, theirs = suite._simulation_class(env_id)(), stock(env_id)()
    before = arrays(ours.model)
    assert len(before) > 300
    for episode, actions in enumerate(np.split(1.5 * actions_of(0, 60), 2)):
        for each in (ours, theirs):
            each._freeze_rand_vec, each._set_task_called, each.seeded_rand_vec = False, True, True
            each._partially_observable = bool(episode)
            each.seed(episode)
        for mine, packages in zip(rows_of(ours, actions), rows_of(theirs, actions), strict=True):
            assert mine.dtype == packages.dtype
            assert np.array_equal(mine, packages)
        after = arrays(ours.model)
        moved = {name for name, was in before.items() if after[name].tobytes() != was.tobytes()}
        assert moved <= set(shared_model.PLACES)


def arrays(model):
    """All of the model's numbers, by name."""
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    return {name: each.copy() for name, each in found.items() if isinstance(each, np.ndarray)}


@pytest.mark.parametrize("name", METAWORLD)
def test_environments_stepped_in_turn_are_each_as_if_alone(name):
    task, actions = registry.task(name), actions_of(0, 40)
    both = [suite.SUITE.make(task, seed=0) for _ in range(2)]
    assert both[0]._simulation.model is both[1]._simulation.model
    rows = [[np.append(each.reset(start), [0.0, 0.0])] for start, each in enumerate(both)]
    for action in actions:
        for mine, each in zip(rows, both, strict=True):
            step = each.step(action)
            mine.append(np.append(step.observation, [step.reward, step.success]))
    third = suite.SUITE.make(task, seed=0)
    assert not np.array_equal(*rows)
    for start, mine in enumerate(rows):
        assert np.array_equal(mine, trajectory(third, start, actions))
        package = stock(task.env_id)()
        package.set_task(third._starts[start])
        observations, others = rows_of(package, actions)
        assert np.array_equal(np.asarray(mine)[:, :39], observations.astype(np.float32))
        assert np.array_equal(np.asarray(mine)[1:, 39], others[:, 0])
    for each in (*both, third):
        each.close()


def test_a_new_environment_begins_with_the_places_of_the_file_and_the_last_takes_the_model_along():
    task = registry.task("metaworld/drawer-open")
    first = suite.SUITE.make(task, seed=0)
    shared = first._simulation.shared
    of_file = shared.places()
    first.reset(7)
    moved = shared.places()
    second = suite.SUITE.make(task, seed=0)
    assert all(np.array_equal(*pair) for pair in zip(second._places, of_file, strict=True))
    assert not all(np.array_equal(*pair) for pair in zip(moved, of_file, strict=True))
    path = first._simulation.fullpath
    del shared
    first.close()
    second.close()
    del first, second
    gc.collect()
    assert path not in shared_model._in_use
