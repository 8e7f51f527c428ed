"""What every plug-in must do, over everything the registry finds: a new file is tested the day it appears."""

from dataclasses import fields, replace
from functools import cache

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from hcpg import registry
from hcpg.interfaces import Valued
from hcpg.types import Batch, Spec

SPEC, ROWS = Spec(observation_size=11, action_size=4), 8
POINTS = ("tool", "object", "goal", "approach", "task")


@cache
def method_of(name):
    """The method with every hidden layer eight wide."""
    module = registry.method(name)
    sizes = {each.name: 8 for each in fields(module.Config) if each.name.endswith("hidden_size")}
    return module.METHOD(replace(module.Config(), **sizes), SPEC)


@cache
def fresh(name):
    return jax.jit(method_of(name).init)(jax.random.key(0))


@cache
def compiled(name, call):
    """One compiled program per method and call; `count` is a size, not a number."""
    static = {"propose": 3}.get(call)
    return jax.jit(getattr(method_of(name), call), static_argnums=static)


def batch():
    generator = np.random.default_rng(0)
    rows = [generator.normal(size=(ROWS, SPEC.observation_size)), generator.uniform(-1, 1, (ROWS, 4))]
    rows += [generator.normal(size=ROWS), rows[0][::-1], np.arange(ROWS) % 3 == 0]
    return Batch(*(jnp.asarray(each, jnp.float32) for each in rows))


def shapes(tree):
    return jax.tree.map(lambda leaf: (leaf.shape, str(leaf.dtype)), tree)


@cache
def updated(name):
    """Six updates: the states, the first one fresh, and the metrics of each."""
    states, metrics = [fresh(name)], []
    for index in range(6):
        state, told = compiled(name, "update")(states[-1], batch(), jax.random.key(index))
        states.append(state)
        metrics.append(told)
    return states, metrics


@pytest.mark.parametrize("name", registry.names("methods"))
class TestMethod:
    def test_proposals_are_bounded_and_as_many_as_asked_for(self, name):
        proposals = compiled(name, "propose")(fresh(name), batch().observations[0], jax.random.key(1), 5)
        assert proposals.shape == (5, 4)
        assert float(abs(proposals).max()) <= 1.0
        assert len(np.unique(proposals, axis=0)) == 5

    def test_proposals_follow_from_the_key(self, name):
        propose, observation = compiled(name, "propose"), batch().observations[0]
        one, again, other = (propose(fresh(name), observation, jax.random.key(i), 5) for i in (1, 1, 2))
        np.testing.assert_array_equal(one, again)
        assert not (one == other).all(axis=1).any()

    def test_the_evaluation_action_is_bounded(self, name):
        action = compiled(name, "act")(fresh(name), batch().observations[0], jax.random.key(1))
        assert action.shape == (4,)
        assert float(abs(action).max()) <= 1.0

    def test_every_action_has_a_value_of_its_own(self, name):
        if not isinstance(method_of(name), Valued):
            pytest.skip("it has no critic")
        value, rows = compiled(name, "value"), batch()
        values = value(fresh(name), rows.observations[0], rows.actions)
        assert values.shape == (ROWS,)
        assert np.isfinite(values).all()
        np.testing.assert_allclose(
            values[::-1], value(fresh(name), rows.observations[0], rows.actions[::-1]), rtol=1e-5
        )

    def test_an_update_counts_itself_and_keeps_the_states_structure(self, name):
        states, _ = updated(name)
        assert [int(state.updates) for state in states] == [0, 1, 2, 3, 4, 5, 6]
        assert all(shapes(state) == shapes(states[0]) for state in states)

    def test_updates_stay_finite_and_change_the_proposals(self, name):
        states = updated(name)[0]
        leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(states[-1])]
        assert all(np.isfinite(leaf).all() for leaf in leaves)
        propose, observation = compiled(name, "propose"), batch().observations[0]
        before, after = (
            propose(state, observation, jax.random.key(1), 5) for state in (states[0], states[-1])
        )
        assert float(abs(before - after).max()) > 1e-6
        assert float(abs(after).max()) <= 1.0

    def test_metrics_are_the_same_at_every_update_and_all_reported_at_some(self, name):
        _, metrics = updated(name)
        assert all(shapes(told) == shapes(metrics[0]) for told in metrics)
        assert all(value.shape == () for value in metrics[0].values())
        for metric in metrics[0]:
            reported = [float(told[metric]) for told in metrics if not np.isnan(told[metric])]
            assert reported, metric
            assert np.isfinite(reported).all(), metric

    def test_an_update_follows_from_state_batch_and_key(self, name):
        again, _ = compiled(name, "update")(fresh(name), batch(), jax.random.key(0))
        jax.tree.map(np.testing.assert_array_equal, again, updated(name)[0][1])


@cache
def visited(name):
    """Six observations of a task: the first, and five after a push along every axis."""
    task = registry.task(name)
    environment = registry.suite(task.suite).make(task, seed=0)
    seen = [environment.reset(0)]
    push = np.full(registry.suite(task.suite).spec(task).action_size, 0.5, np.float32)
    seen += [environment.step(push).observation for _ in range(5)]
    environment.close()
    return np.stack(seen)


CASES = [(name, family) for name in registry.names("tasks") for family in registry.task(name).adapters]
# Their tool is the head of a peg, which lies still on the table until it is grasped.
LYING_TOOLS = {("maniskill/poke-cube", "paper"), ("maniskill/poke-cube-delta-pos", "paper")}


def points_of(scene):
    return np.stack([np.asarray(getattr(scene, point), np.float64) for point in POINTS])


@pytest.mark.parametrize(("name", "family"), CASES)
class TestTask:
    def test_a_scene_is_finite_and_has_its_shapes(self, name, family):
        scene = registry.task(name).adapters[family](visited(name)[0])
        assert points_of(scene).shape == (5, 3)
        assert np.isfinite(points_of(scene)).all()
        if scene.contact is not None:
            assert np.shape(scene.contact) == ()
            assert 0.0 <= float(scene.contact) <= 1.0

    def test_scenes_are_read_alike_one_by_one_in_batches_and_under_jit(self, name, family):
        read, observations = registry.task(name).adapters[family], visited(name)
        singly = np.stack([points_of(read(each)) for each in observations], axis=1)
        np.testing.assert_allclose(points_of(read(observations)), singly, atol=1e-6)
        np.testing.assert_allclose(points_of(jax.jit(read)(observations)), singly, atol=1e-5)

    def test_the_tool_moves_when_the_simulator_does(self, name, family):
        tool = np.asarray(registry.task(name).adapters[family](visited(name)).tool)
        moved = float(np.linalg.norm(tool[-1] - tool[0]))
        assert moved < 1e-5 if (name, family) in LYING_TOOLS else 0.001 < moved < 0.3

    def test_observations_have_the_specs_size(self, name, family):
        task = registry.task(name)
        assert visited(name).shape[1] == registry.suite(task.suite).spec(task).observation_size
        assert family in ("paper", "contact")


@cache
def first_observations(suite, seed):
    """The first observations of four start states of the suite's first task."""
    task = next(registry.task(name) for name in registry.names("tasks") if name.startswith(f"{suite}/"))
    environment = registry.suite(suite).make(task, seed)
    seen = [np.array(environment.reset(start)) for start in range(4)]
    again = np.array(environment.reset(1))
    environment.close()
    return seen, again


@pytest.mark.parametrize("name", registry.names("suites"))
class TestSuite:
    def test_a_start_state_is_the_same_every_time_and_in_every_environment_of_its_seed(self, name):
        seen, again = first_observations(name, 0)
        np.testing.assert_array_equal(seen[1], again)
        first_observations.cache_clear()
        for one, other in zip(seen, first_observations(name, 0)[0], strict=True):
            np.testing.assert_array_equal(one, other)

    def test_start_states_differ_within_a_seed_and_between_seeds(self, name):
        every = [
            tuple(each.tolist()) for seed in (0, 1, 1_000_003) for each in first_observations(name, seed)[0]
        ]
        assert len(set(every)) == 12
