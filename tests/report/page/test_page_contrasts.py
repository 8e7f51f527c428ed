"""Differences to the reference: signs, intervals and verdicts known from the runs in conftest."""

import pytest

from hcpg.report.page.contrasts import across_tasks, contrasts


@pytest.fixture(scope="module")
def against_ours(groups):
    return {each["preset"]: each for each in contrasts(groups, "hcpg_flow")}


def test_a_lost_seed_leaves_it_undecided(against_ours):
    """One seed of two is 100 points behind, the other equal: all, half or none of two draws."""
    found = against_ours["sac_flow"]
    assert found["paired"] == {"estimate": -50.0, "low": -100.0, "high": 0.0}
    assert (found["task"], found["verdict"]) == ("metaworld/drawer-open", "undecided")
    assert found["conclusion"].startswith("Undecided: the interval includes zero; 2 seeds say little")


def test_a_clear_difference_is_called_worse_and_turns_with_the_reference(groups, against_ours):
    """Four of ten start states are solved by both, the others by hcpg_flow alone."""
    (odd,) = [each for preset, each in against_ours.items() if preset != "sac_flow"]
    assert (odd["paired"]["estimate"], odd["verdict"]) == (-60.0, "worse")
    assert -100 < odd["paired"]["low"] < odd["paired"]["high"] < 0
    turned = [each for each in contrasts(groups, odd["preset"]) if each["preset"] == "hcpg_flow"]
    assert [(each["paired"]["estimate"], each["verdict"]) for each in turned] == [(60.0, "better")]
    assert turned[0]["paired"]["low"] == -odd["paired"]["high"]


def test_over_tasks(groups):
    sac_flow, ours = across_tasks(groups, ["sac_flow", "hcpg_flow"], "hcpg_flow")
    assert (ours["tasks"], ours["collapsed"], ours["mean"]["mean"]) == (2, [0, 4], 75.0)
    assert ours["middle"] == {"estimate": 75.0, "low": 75.0, "high": 75.0}
    assert ours["improvement"] is None
    assert (sac_flow["tasks"], sac_flow["mean"], sac_flow["middle"]) == (1, None, None)
    # Of its two seeds one is worse than both of ours, one better.
    assert sac_flow["improvement"] == {"estimate": 50.0, "low": 0.0, "high": 100.0}
