from typing import get_args

import numpy as np
import pytest
from scipy.stats import chisquare

from hcpg.selection import RULES, Selector, select
from hcpg.selection.selectors import Evidence, RuleName

SCORES = np.array([0.1, 0.9, 0.4, 0.7])
ALL = np.ones(4, bool)


def weigh(rule, usable=ALL, noise=None, values=None, **settings):
    selector = Selector(rule=rule, **settings)
    return RULES[rule].weigh(selector, Evidence(SCORES, usable, noise, values))


def test_the_defaults_are_the_papers_constants():
    selector = Selector()
    settings = (selector.rule, selector.candidates, selector.temperature, selector.top_k)
    assert settings == ("hcpg", 4, 0.7, None)
    assert (selector.gate_radius_m, selector.action_penalty, selector.epsilon) == (0.08, 0.05, 1e-6)


def test_every_rule_has_a_type_checked_name():
    assert tuple(RULES) == get_args(RuleName)


def test_the_hard_rules_put_all_weight_on_one():
    lots, values = np.array([0.2, 0.1, 0.8, 0.3]), np.array([5.0, -1.0, 2.0, 4.0])
    assert weigh("first").tolist() == [1.0, 0.0, 0.0, 0.0]
    assert weigh("argmax").tolist() == [0.0, 1.0, 0.0, 0.0]
    assert weigh("random", noise=lots).tolist() == [0.0, 0.0, 1.0, 0.0]
    assert weigh("value", values=values).tolist() == [1.0, 0.0, 0.0, 0.0]


def test_the_mean_weighs_all_alike():
    assert weigh("mean").tolist() == [0.25] * 4


def test_tied_values_go_to_the_lowest_index():
    assert weigh("value", values=np.array([1.0, 3.0, 3.0, 3.0])).tolist() == [0.0, 1.0, 0.0, 0.0]


def test_soft_values_are_weighed_as_hcpg_weighs_scores():
    assert weigh("value_soft", values=SCORES * 40.0 - 7.0) == pytest.approx(weigh("hcpg"))


def test_a_low_temperature_makes_hcpg_the_argmax():
    assert weigh("hcpg", temperature=1e-3) == pytest.approx(weigh("argmax"))
    assert weigh("hcpg", temperature=1e6) == pytest.approx([0.25] * 4, abs=1e-6)


def test_permuted_deals_the_same_weights_by_the_lots():
    lots = np.array([0.2, 0.1, 0.8, 0.3])
    dealt, largest_first = weigh("permuted", noise=lots), np.sort(weigh("hcpg"))[::-1]
    assert dealt.tolist() == largest_first[[2, 3, 0, 1]].tolist()


@pytest.mark.parametrize("rule", ["random", "permuted"])
def test_lots_favour_nobody(rule, generator):
    lots = generator.uniform(size=(4000, 4))
    evidence = Evidence(np.tile(SCORES, (4000, 1)), np.ones((4000, 4), bool), lots, None)
    winners = np.argmax(RULES[rule].weigh(Selector(rule=rule), evidence), axis=-1)
    assert chisquare(np.bincount(winners, minlength=4)).pvalue > 0.01


@pytest.mark.parametrize("rule", RULES)
def test_an_unusable_candidate_gets_no_weight_and_the_rest_sum_to_one(rule, generator):
    for _ in range(20):
        usable = generator.permutation([False, True, True, False])
        weights = weigh(rule, usable, generator.uniform(size=4), generator.normal(size=4))
        assert weights[~usable].tolist() == [0.0, 0.0]
        assert weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("rule", "needs"),
    [
        ("hcpg", (False, False)),
        ("permuted", (True, False)),
        ("random", (True, False)),
        ("value", (False, True)),
    ],
)
def test_a_selector_says_what_it_needs(rule, needs):
    selector = Selector(rule=rule)
    assert (selector.needs_noise, selector.needs_values) == needs


def test_an_unknown_rule_is_answered_with_the_closest(unchecked):
    with pytest.raises(
        ValueError, match=r"no selection rule is named 'hpcg'. Did you mean 'hcpg'\? Known: hcpg, first"
    ):
        Selector(rule="hpcg")


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("candidates", 0, r"candidates is 0; it must lie in \[1, 1e\+06\]"),
        ("temperature", 0.0, r"temperature is 0.0; it must lie in \[1e-06, 1e\+06\]"),
        ("temperature", float("nan"), "temperature is nan"),
        ("gate_radius_m", -0.1, "gate_radius_m is -0.1"),
        ("action_penalty", float("inf"), "action_penalty is inf"),
        ("epsilon", 0.0, "epsilon is 0.0"),
        ("top_k", 0, "top_k is 0; keep at least 1"),
        ("translation", (2, 4), r"translation is \(2, 4\); it must be \(i, i \+ 3\)"),
        ("translation", (-3, 0), r"translation is \(-3, 0\)"),
        ("bounds", (1.0, -1.0), r"bounds is \(1.0, -1.0\); the lower must lie below"),
    ],
)
def test_a_setting_out_of_range_is_refused(setting, value, message):
    with pytest.raises(ValueError, match=message):
        Selector(**{setting: value})


def test_the_translation_may_lie_anywhere_in_the_action(flagged_scene):
    # Gripper first: the translation is the last three numbers.
    proposals = np.array([[1.0, -0.5, 0.0, 0.0], [-1.0, 0.5, 0.0, 0.0]])
    _, seen = select(proposals, flagged_scene, Selector(translation=(1, 4)))
    assert seen.scores == pytest.approx([-0.525, 0.475])
