"""Environments of a task share one model, and none can tell."""

import gc

import numpy as np
import pytest
from trajectories import actions_of, trajectory

from hcpg import registry
from hcpg.experiments.protocols import METAWORLD
from hcpg.suites import metaworld as suite
from hcpg.suites.metaworld import shared_model

ALL = sorted(suite._metaworld().ALL_V3_ENVIRONMENTS)


def alone(env_id, tasks, start, actions):
    """The package's own class, which has a model for itself."""
    simulation = suite._metaworld().ALL_V3_ENVIRONMENTS[env_id]()
    simulation.set_task(tasks[start])
    rows = [np.append(simulation.reset()[0].astype(np.float32), [0.0, 0.0])]
    for action in actions:
        observation, reward, _, _, info = simulation.step(action)
        rows.append(np.append(observation.astype(np.float32), [reward, bool(info["success"])]))
    return np.asarray(rows)


@pytest.mark.parametrize("name", METAWORLD)
def test_environments_stepped_in_turn_are_those_of_the_package_bit_for_bit(name):
    task, actions = registry.task(name), actions_of(0, 40)
    both = [suite.SUITE.make(task, seed=0) for _ in range(2)]
    assert both[0]._simulation.model is both[1]._simulation.model
    tasks = both[0]._starts
    rows = [[np.append(each.reset(start), [0.0, 0.0])] for start, each in enumerate(both)]
    for action in actions:
        for mine, each in zip(rows, both, strict=True):
            step = each.step(action)
            mine.append(np.append(step.observation, [step.reward, step.success]))
    third = suite.SUITE.make(task, seed=0)
    for start, mine in enumerate(rows):
        assert np.array_equal(mine, alone(task.env_id, tasks, start, actions))
        assert np.array_equal(mine, trajectory(third, start, actions))
    assert not np.array_equal(*rows)
    for each in (*both, third):
        each.close()


def arrays(model):
    """All of the model's numbers, by name."""
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    return {name: each.copy() for name, each in found.items() if isinstance(each, np.ndarray)}


@pytest.mark.parametrize("env_id", ALL)
def test_an_episode_changes_nothing_but_places(env_id):
    simulation = suite._simulation_class(env_id)()
    simulation._freeze_rand_vec, simulation._set_task_called = False, True
    before, moved = arrays(simulation.model), set()
    assert len(before) > 300
    for action in actions_of(0, 6):
        simulation.reset()
        for _ in range(3):
            simulation.step(action)
        after = arrays(simulation.model)
        moved |= {name for name, was in before.items() if after[name].tobytes() != was.tobytes()}
    assert moved <= set(shared_model.PLACES)


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
