"""The named pairs and budgets: what they hold, and that a run's settings survive its config.json."""

import json
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from hcpg import presets, registry
from hcpg.presets import ARMS, BUDGETS, PRESETS, UnservedSelectorError
from hcpg.registry import UnknownNameError
from hcpg.selection import Selector

PAIRS = [(preset, budget) for preset in PRESETS for budget in BUDGETS]


@pytest.mark.parametrize(("preset", "budget"), PAIRS)
def test_settings_come_back_from_json(preset, budget):
    chosen = presets.settings("point/carry", preset, budget)
    assert presets.from_json(json.loads(json.dumps(chosen.as_json()))) == chosen


def test_settings_other_than_the_presets_come_back_from_json():
    chosen = presets.settings("point/carry")
    changed = replace(
        chosen,
        learner=replace(chosen.learner, discount=0.9),
        selector=replace(chosen.selector, translation=(1, 4), bounds=None, top_k=2),
        budget=replace(chosen.budget, steps=123),
    )
    back = presets.from_json(json.loads(json.dumps(changed.as_json())))
    assert back == changed
    assert back.selector.translation == (1, 4)
    assert back != chosen


@pytest.mark.parametrize(("preset", "budget"), PAIRS)
def test_a_preset_carries_its_names(preset, budget):
    chosen = presets.settings("point/carry", preset, budget)
    assert (chosen.task, chosen.preset, chosen.budget.name) == ("point/carry", preset, budget)
    assert chosen.adapter == "paper"
    assert chosen.selector == PRESETS[preset].selector


def test_only_the_arms_that_say_so_evaluate_with_another_selector():
    other = {
        name: (chosen.selector.rule, chosen.evaluation_selector.rule)
        for name in PRESETS
        if (chosen := presets.settings("point/carry", name)).evaluation_selector != chosen.selector
    }
    assert other == {"hcpg_training_only": ("hcpg", "first"), "hcpg_evaluation_only": ("first", "hcpg")}


@pytest.mark.parametrize("budget", BUDGETS)
def test_the_arms_learn_as_sac_flow_does_and_differ_in_the_selector_alone(budget):
    plain = presets.settings("point/carry", "sac_flow", budget)
    for preset in ("hcpg_flow", *ARMS):
        chosen = presets.settings("point/carry", preset, budget)
        assert (chosen.method, chosen.learner) == ("sac_flow", plain.learner)
        assert (chosen.selector, chosen.evaluation_selector) != (plain.selector, plain.evaluation_selector)


def test_hcpg_flow_blends_four_and_sac_flow_takes_the_only_one():
    assert PRESETS["hcpg_flow"].selector == Selector("hcpg", candidates=4)
    assert PRESETS["sac_flow"].selector == Selector("first", candidates=1)


@pytest.mark.parametrize("budget", BUDGETS)
@pytest.mark.parametrize("velocity", ["decoder", "plain"])
def test_the_other_fields_differ_from_sac_flow_in_the_field_alone(velocity, budget):
    plain = presets.settings("point/carry", "sac_flow", budget)
    chosen = presets.settings("point/carry", f"sac_flow_{velocity}", budget)
    # The published plain field does not act as it learns (docs/baselines.md): at `cpu` it is mended.
    mended = {"plain_norm": "per_step"} if (velocity, budget) == ("plain", "cpu") else {}
    assert chosen.learner == replace(plain.learner, velocity=velocity, **mended)
    assert chosen.selector == plain.selector


def test_the_recipes_with_target_networks_have_their_published_numbers():
    polyak, rlinf = (
        presets.settings("point/carry", f"sac_flow_{name}", "paper").learner for name in ("polyak", "rlinf")
    )
    for each in (polyak, rlinf):
        rates = each.actor_learning_rate, each.critic_learning_rate, each.temperature_learning_rate
        assert rates == (3e-4, 3e-4, 3e-4)
        assert (each.critic, each.target_rate, each.momentum) == ("polyak", 0.005, 0.9)
        assert (each.initial_temperature, each.flow_steps) == (0.2, 4)
    assert (polyak.velocity, polyak.policy_delay, polyak.critic_hidden_size) == ("gated", 1, 512)
    assert (polyak.discount, polyak.target_entropy) == (0.99, 0.0)
    assert (rlinf.velocity, rlinf.policy_delay, rlinf.critic_hidden_size) == ("decoder", 3, 256)
    assert (rlinf.discount, rlinf.target_entropy, rlinf.decoder_hidden_size) == (0.8, -4.0, 96)


def test_the_papers_budget_is_the_papers():
    paper = BUDGETS["paper"]
    assert (paper.steps, paper.warmup_steps, paper.batch_size) == (1_000_000, 50_000, 512)
    assert (paper.environments, paper.updates_per_step) == (1, 1.0)
    assert (paper.evaluations, paper.evaluation_episodes, paper.replay_capacity) == (25, 50, 1_000_000)


def test_at_the_papers_budget_the_methods_own_defaults_hold():
    for preset in ("hcpg_flow", "sac_flow", "sac", "flowrl"):
        chosen = presets.settings("point/carry", preset, "paper")
        assert chosen.learner == registry.method(chosen.method).Config()


def test_the_page_on_baselines_names_every_preset_and_one_short_run_of_each_is_stored():
    docs = Path(__file__).parents[1] / "docs"
    page = (docs / "baselines.md").read_text()
    stored = (docs / "evidence/every_preset/README.md").read_text()
    shown = {row.split("|")[2].strip() for row in stored.splitlines() if row.startswith("| point/reach ")}
    assert {name for name in PRESETS if f"`{name}`" not in page} == set()
    assert set(PRESETS) == shown


def test_overrides_name_real_settings_of_real_budgets():
    for preset in PRESETS.values():
        known = {each.name for each in fields(registry.method(preset.method).Config)}
        assert {name.partition("/")[0] for name in preset.overrides} <= set(BUDGETS)
        assert {name.partition("/")[2] for name in preset.overrides} <= {"", *registry.names("suites")}
        assert all(set(changes) <= known for changes in (preset.learner, *preset.overrides.values()))


def test_on_maniskill_sac_flow_keeps_its_published_entropy_at_both_budgets_and_elsewhere_at_the_papers():
    def of(task, preset, budget):
        learner = presets.settings(task, preset, budget).learner
        return learner.target_entropy, learner.temperature_learning_rate

    for preset in ("hcpg_flow", "sac_flow", "q_guided", "sac_flow_decoder"):
        assert of("maniskill/push-cube", preset, "cpu") == (0.0, 1e-3)
        assert of("maniskill/push-cube", preset, "paper") == (0.0, 1e-3)
        assert of("metaworld/drawer-open", preset, "cpu") == (24.0, 3e-4)
        assert of("metaworld/drawer-open", preset, "paper") == (0.0, 1e-3)


def test_what_a_budget_asks_for_goes_before_what_the_preset_is():
    narrow = presets.settings("point/carry", "sac_crossq", "cpu").learner
    wide = presets.settings("point/carry", "sac_crossq", "paper").learner
    assert (narrow.critic, narrow.critic_hidden_size, narrow.discount) == ("crossq", 256, 0.97)
    assert (wide.critic, wide.critic_hidden_size, wide.discount) == ("crossq", 1024, 0.99)


def test_an_unknown_preset_or_budget_is_told_with_the_nearest():
    with pytest.raises(UnknownNameError, match=r"no preset is named 'hcpg_flo'\. Did you mean 'hcpg_flow'\?"):
        presets.settings("point/carry", "hcpg_flo")
    with pytest.raises(UnknownNameError, match=r"no budget is named 'gpu'.* Known: .*cpu, .*paper"):
        presets.settings("point/carry", "hcpg_flow", "gpu")


@pytest.mark.parametrize("part", ["selector", "evaluation_selector"])
def test_a_selector_that_ranks_by_value_is_refused_for_a_method_without_critic(part, monkeypatch):
    settings = presets.settings("point/carry", "mean")
    asking = replace(settings, **{part: Selector("value_soft")})
    presets.refuse_unserved(asking)
    monkeypatch.setattr(registry, "method", lambda _: SimpleNamespace(METHOD=type("Cloned", (), {})))
    presets.refuse_unserved(settings)
    with pytest.raises(
        UnservedSelectorError, match=r"'value_soft' .* 'sac_flow' has no .* hcpg, first, mean"
    ):
        presets.refuse_unserved(asking)


def test_a_suites_discount_holds_for_every_method_and_its_temperature_where_there_is_one():
    sac_flow, flowrl = (
        presets.settings("maniskill/push-cube", name).learner for name in ("hcpg_flow", "flowrl")
    )
    assert (sac_flow.discount, sac_flow.initial_temperature) == (0.8, 0.01)
    assert flowrl.discount == 0.8
    assert not hasattr(flowrl, "initial_temperature")
    assert presets.settings("metaworld/reach", "hcpg_flow").learner.discount == 0.97
