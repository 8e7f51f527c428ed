"""The evaluation protocol with a policy whose number of steps is known on paper."""

from dataclasses import replace

import numpy as np
import pytest
from jax import numpy as jnp
from stand_ins import Reacher, Scalar

from hcpg import presets, registry
from hcpg.loops.evaluation import EVALUATION_SEED, Evaluator
from hcpg.suites.point import optimal_steps

DISCOUNT = 0.9
EPISODES = 12
"""More than fit side by side, so that there is a second wave with idle places."""
TASK = registry.task("point/reach")


class Judge(Reacher):
    """A reacher with a critic: the tool's x plus the action's first entry plus 5."""

    def value(self, state, observation, actions):
        return observation[0] + actions[:, 0] + 5


def evaluated(method, seeds=(0, 1)):
    """Rows of runs of which the first moves straight to the object, the second not at all."""
    settings = presets.settings("point/reach", "hcpg_flow", "cpu")
    settings = replace(
        settings,
        budget=replace(settings.budget, evaluation_episodes=EPISODES),
        learner=replace(settings.learner, discount=DISCOUNT),
    )
    evaluator = Evaluator(settings, method, TASK.adapters["paper"], seeds=list(seeds))
    states = Scalar(jnp.arange(float(len(seeds))), jnp.int32(0))
    try:
        return evaluator.evaluate(states, step=400, workers=1)
    finally:
        evaluator.close()


@pytest.fixture(scope="module")
def rows():
    return evaluated(Reacher())


def of(rows, selector):
    return [row for row in rows if row["selector"] == selector]


@pytest.mark.parametrize("selector", ["hcpg", "bare"])
def test_the_straight_policy_takes_the_fewest_steps_from_every_start(rows, selector):
    environment = registry.suite("point").make(TASK, EVALUATION_SEED)
    fewest = [optimal_steps(TASK, environment.reset(start)) for start in range(EPISODES)]
    assert [row["steps_to_success"] for row in of(rows[0], selector)] == fewest
    assert all(row["success_once"] and row["success_at_end"] for row in of(rows[0], selector))


def test_the_policy_that_stands_still_never_succeeds(rows):
    assert {row["steps_to_success"] for row in rows[1]} == {-1}
    assert not any(row["success_once"] for row in rows[1])


def test_every_run_has_every_start_state_once_with_the_selector_and_once_bare(rows):
    for of_run in rows:
        assert [row["selector"] for row in of_run] == ["hcpg"] * EPISODES + ["bare"] * EPISODES
        for selector in ("hcpg", "bare"):
            assert [row["start"] for row in of(of_run, selector)] == list(range(EPISODES))


def test_with_one_proposal_only_the_methods_own_action_is_evaluated():
    settings = presets.settings("point/reach", "sac_flow", "cpu")
    settings = replace(settings, budget=replace(settings.budget, evaluation_episodes=2))
    evaluator = Evaluator(settings, Reacher(), TASK.adapters["paper"], seeds=[0])
    try:
        [rows] = evaluator.evaluate(Scalar(jnp.zeros(1), jnp.int32(0)), step=400, workers=1)
    finally:
        evaluator.close()
    assert [(row["selector"], row["start"]) for row in rows] == [("bare", 0), ("bare", 1)]


def test_a_row_says_when_where_and_how_long(rows):
    row = rows[0][0]
    facts = {name: row[name] for name in ("step", "phase", "adapter", "length")}
    assert facts == {"step": 400, "phase": "evaluation", "adapter": "paper", "length": 60}
    assert [row["environment"] for row in of(rows[1], "bare")] == [*range(10), 0, 1]


def test_the_return_is_the_sum_of_the_rewards_of_that_start(rows):
    """The one that stands still earns 60 times its first reward, 1 - tanh(distance / 0.1 m)."""
    environment = registry.suite("point").make(TASK, EVALUATION_SEED)
    for row in of(rows[1], "bare"):
        first = environment.reset(row["start"])
        distance = np.linalg.norm(first[4:7] - first[0:3])
        np.testing.assert_allclose(row["return"], 60 * (1 - np.tanh(distance / 0.1)), rtol=1e-4)


def test_what_comes_of_an_episode_is_discounted_by_the_learners_discount(rows):
    """Standing still earns the same reward 60 times: that reward * (1 - 0.9 ** 60) / 0.1."""
    for row in of(rows[1], "bare"):
        expected = row["return"] / 60 * (1 - DISCOUNT**60) / (1 - DISCOUNT)
        np.testing.assert_allclose(row["discounted_return"], expected, rtol=1e-5)


def test_what_the_critic_expects_is_of_the_first_action_at_the_first_observation():
    environment = registry.suite("point").make(TASK, EVALUATION_SEED)
    rows = evaluated(Judge())
    for run, moves in enumerate((True, False)):
        for row in of(rows[run], "hcpg") + of(rows[run], "bare"):
            first = environment.reset(row["start"])
            move = np.clip((first[4] - first[0]) / 0.02, -1, 1) * moves
            np.testing.assert_allclose(row["value"], first[0] + move + 5, rtol=1e-5)


def test_without_a_critic_nothing_is_expected(rows):
    assert np.isnan([row["value"] for row in rows[0] + rows[1]]).all()
