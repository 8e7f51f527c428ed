"""The tables as data: what they ask for exists, and everybody gets the same."""

import pytest

from hcpg.commands.options import check
from hcpg.experiments.protocols import ABLATED, MANISKILL, METAWORLD, PROTOCOLS, TABLES, protocol
from hcpg.registry import UnknownNameError


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_run_of_a_protocol_could_be_trained(name):
    for settings in protocol(name).settings():
        check(settings)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_all_methods_of_a_table_get_the_same_budget_adapter_discount_and_seeds_on_a_task(name):
    settings = protocol(name).settings()
    assert {each.adapter for each in settings} == {"contact" if name.startswith("contact") else "paper"}
    assert len({each.budget for each in settings}) == 1
    for task in protocol(name).tasks:
        on_task = [each for each in settings if each.task == task]
        assert [each.preset for each in on_task] == list(protocol(name).presets)
        assert len({each.learner.discount for each in on_task}) == 1
    seeds = {}
    for cell in protocol(name).cells():
        seeds.setdefault((cell.settings.task, cell.settings.preset), []).append(cell.seed)
    assert set(map(tuple, seeds.values())) == {protocol(name).seeds}


@pytest.mark.parametrize(
    ("name", "tasks", "presets", "runs"),
    [
        ("metaworld", METAWORLD, ["sac", "flowrl", "qsm", "sac_flow", "hcpg_flow"], 90),
        ("maniskill", MANISKILL, ["flowrl", "qsm", "sac_flow", "hcpg_flow"], 48),
        ("ablation", ABLATED, ["sac_flow", "q_guided", "hcpg_k2", "hcpg_flow", "hcpg_k8"], 45),
        ("k_sensitivity", ABLATED, ["hcpg_k2", "hcpg_flow", "hcpg_k8"], 27),
    ],
)
def test_the_papers_tables_are_there_at_both_budgets(name, tasks, presets, runs):
    for key, budget in ((name, "cpu"), (f"{name}_paper", "paper")):
        cells = protocol(key).cells()
        assert {cell.settings.task for cell in cells} == set(tasks)
        assert list(dict.fromkeys(cell.settings.preset for cell in cells)) == presets
        assert {cell.seed for cell in cells} == {0, 1, 2}
        assert {cell.settings.budget.name for cell in cells} == {budget}
        assert len(cells) == runs
    assert (len(METAWORLD), len(MANISKILL), len(ABLATED)) == (6, 4, 3)


def test_the_candidate_counts_of_the_ablation_are_the_papers():
    chosen = protocol("ablation").settings()[:5]
    assert [each.selector.candidates for each in chosen] == [1, 4, 2, 4, 8]
    assert [each.selector.rule for each in chosen] == ["first", "value", "hcpg", "hcpg", "hcpg"]


def test_the_control_arms_are_in_a_table_of_each_suite():
    arms = {"mean", "permuted", "random", "argmax", "q_guided", "q_guided_soft", "hcpg_opposed"}
    for name in ("controls", "maniskill_controls"):
        assert arms < set(protocol(name).presets)


@pytest.mark.parametrize(
    ("name", "task", "steps", "environments", "warmup_steps"),
    [
        ("metaworld_paper", "metaworld/door-open", 1_000_000, 1, 50_000),
        ("maniskill_paper", "maniskill/pick-cube", 1_000_000, 32, 50_000),
        ("maniskill_paper", "maniskill/poke-cube", 1_000_000, 32, 50_000),
        ("maniskill", "maniskill/pick-cube", 100_000, 8, 5_000),
        ("maniskill", "maniskill/push-cube", 100_000, 8, 5_000),
        ("controls", "metaworld/drawer-open", 60_000, 8, 5_000),
    ],
)
def test_the_budget_of_a_task(name, task, steps, environments, warmup_steps):
    budget = next(each.budget for each in protocol(name).settings() if each.task == task)
    assert (budget.steps, budget.environments, budget.warmup_steps) == (steps, environments, warmup_steps)


def test_maniskill_at_the_papers_budget_evaluates_16_episodes_and_discounts_by_0_8():
    settings = protocol("maniskill_paper").settings()
    assert {(each.budget.evaluations, each.budget.evaluation_episodes) for each in settings} == {(25, 16)}
    assert {each.learner.discount for each in settings} == {0.8}
    assert {each.budget.updates_per_step for each in settings} == {0.5}


def test_every_table_is_there_at_both_budgets():
    assert set(PROTOCOLS) == {"smoke", *TABLES, *(f"{name}_paper" for name in TABLES)}


def test_an_unknown_experiment_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"'metawrld'\. Did you mean 'metaworld'\?.*smoke"):
        protocol("metawrld")
