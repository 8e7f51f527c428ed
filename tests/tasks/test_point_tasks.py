"""The point tasks: found by name, and what their adapters read."""

import numpy as np

from hcpg import registry

OBSERVATION = np.array([0.1, 0.2, 0.3, 0.5, 0.4, 0.2, 0.0, 0.4, 0.6, 0.1, 1.0], np.float32)


def test_the_registry_finds_the_tasks_and_their_suite():
    assert {"point/carry", "point/reach"} <= set(registry.task_names())
    for name in ("point/carry", "point/reach"):
        task = registry.task(name)
        assert (task.suite, task.horizon, sorted(task.adapters)) == ("point", 60, ["contact", "paper"])
        assert registry.suite(task.suite).spec(task) == (11, 4)


def test_carry_reads_tool_object_goal_and_the_observed_flag():
    for read in registry.task("point/carry").adapters.values():
        scene = read(OBSERVATION)
        np.testing.assert_allclose(scene.approach, [0.3, 0.0, -0.3], atol=1e-7)
        np.testing.assert_allclose(scene.task, [0.0, 0.4, 0.1], atol=1e-7)
        assert scene.contact == 1.0


def test_reach_never_leaves_the_approach():
    for read in registry.task("point/reach").adapters.values():
        scene = read(OBSERVATION)
        np.testing.assert_allclose(scene.approach, [0.3, 0.0, -0.3], atol=1e-7)
        assert scene.task.tolist() == [0.0, 0.0, 0.0]
        assert scene.contact == 0.0


def test_adapters_read_batches():
    for name in ("point/carry", "point/reach"):
        scene = registry.task(name).adapters["paper"](np.tile(OBSERVATION, (2, 3, 1)))
        assert scene.tool.shape == scene.task.shape == (2, 3, 3)
        assert scene.contact.shape == (2, 3)
