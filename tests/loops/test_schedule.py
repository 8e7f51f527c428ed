"""Budgets in ticks, counted by hand; and refusals that name the wrong value."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hcpg.loops.schedule import BudgetError, Schedule
from hcpg.presets import BUDGETS, Budget

SMALL = Budget(
    "small",
    steps=100,
    environments=4,
    updates_per_step=0.5,
    warmup_steps=20,
    batch_size=10,
    evaluations=5,
    evaluation_episodes=2,
    replay_capacity=400,
)


def schedule(**changes):
    return Schedule.of(replace(SMALL, **changes), horizon=10)


def updates(made):
    return sum(made.updates_per_tick for tick in range(made.ticks()) if made.learns(tick))


def test_a_tick_is_one_step_of_every_environment():
    made = schedule()
    assert (made.ticks(), made.updates_per_tick, made.ticks_per_update) == (25, 2, 1)


def test_a_run_that_does_not_divide_ends_with_a_whole_tick():
    assert schedule(steps=101).ticks() == 26


def test_warm_up_ends_with_the_tick_that_reaches_it_and_learning_starts_then():
    made = schedule()
    assert [made.explores(tick) for tick in (0, 4, 5)] == [True, True, False]
    assert [made.learns(tick) for tick in (0, 4, 5, 24)] == [False, False, True, True]
    assert updates(made) == (100 - 20) * 0.5


def test_less_than_one_update_per_tick_becomes_one_every_few_ticks():
    made = schedule(updates_per_step=0.05)  # 0.2 per tick
    assert (made.updates_per_tick, made.ticks_per_update) == (1, 5)
    assert [tick for tick in range(25) if made.learns(tick)] == [5, 10, 15, 20]
    assert updates(made) == (100 - 20) * 0.05


@pytest.mark.parametrize("name", BUDGETS)
def test_the_budgets_make_the_updates_they_promise(name):
    budget = BUDGETS[name]
    made = Schedule.of(budget, horizon=500)
    warm = budget.warmup_steps // budget.environments
    assert not made.learns(warm - 1)
    assert made.learns(warm)
    total = (made.ticks() - warm) // made.ticks_per_update * made.updates_per_tick
    assert total == (budget.steps - budget.warmup_steps) * budget.updates_per_step


def test_the_papers_budget_is_a_million_steps_and_950000_updates():
    made = Schedule.of(BUDGETS["paper"], horizon=500)
    assert (made.ticks(), made.updates_per_tick, made.ticks_per_update) == (1_000_000, 1, 1)
    assert not made.learns(49_999)
    assert made.learns(50_000)


def test_evaluations_are_evenly_spaced_and_the_last_comes_at_the_end():
    made = schedule()
    assert [tick for tick in range(1, 26) if made.evaluates(tick)] == [5, 10, 15, 20, 25]
    assert [tick for tick in range(1, 26) if schedule(evaluations=4).evaluates(tick)] == [7, 13, 19, 25]


@given(steps=st.integers(20, 500), environments=st.sampled_from([1, 2, 4]), evaluations=st.integers(1, 5))
def test_there_are_as_many_evaluations_as_the_budget_says(steps, environments, evaluations):
    made = schedule(steps=steps, environments=environments, updates_per_step=1.0, evaluations=evaluations)
    ticks = [tick for tick in range(made.ticks() + 1) if made.evaluates(tick)]
    assert len(ticks) == evaluations
    assert ticks[-1] == made.ticks()
    assert ticks[0] > 0


def test_a_long_run_writes_a_hundred_rows_and_a_short_one_a_row_per_tick():
    long = Schedule.of(BUDGETS["cpu"], horizon=60)
    assert sum(long.logs(tick) for tick in range(1, long.ticks() + 1)) == 100
    assert all(schedule().logs(tick) for tick in range(1, 26))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": 0}, "steps 0 must be at least 1"),
        ({"environments": 0}, "environments 0 must be at least 1"),
        ({"updates_per_step": 0.0}, "updates_per_step 0.0 must be positive"),
        ({"updates_per_step": float("nan")}, "updates_per_step nan must be positive"),
        ({"batch_size": 0}, "batch_size 0 must be at least 1"),
        ({"evaluations": 0}, "evaluations 0 must be at least 1"),
        ({"training_horizon": 0}, "training_horizon 0 must be at least 1"),
        ({"evaluations": 26}, "evaluations 26 must be at most one per step of 4 environments"),
        ({"evaluation_episodes": 0}, "evaluation_episodes 0 must be at least 1"),
        ({"warmup_steps": 9}, "warmup_steps 9 must fill a batch of 10"),
        ({"replay_capacity": 398}, "replay_capacity 398 must be a multiple of 4 environments"),
        ({"replay_capacity": 36}, "replay_capacity 36 must hold one episode of each environment, 40"),
        ({"updates_per_step": 0.3}, "updates_per_step 0.3 times 4 environments is 1.2 updates per tick"),
        ({"updates_per_step": 0.3}, "Nearest: updates_per_step 0.25"),
    ],
)
def test_a_budget_that_cannot_be_carried_out_is_refused_by_its_value(changes, message):
    with pytest.raises(BudgetError) as refusal:
        schedule(**changes)
    assert message in str(refusal.value)


def test_all_that_is_wrong_is_told_at_once():
    with pytest.raises(BudgetError, match=r"steps 0 .*; batch_size 0 .*; warmup_steps -1"):
        schedule(steps=0, batch_size=0, warmup_steps=-1)
