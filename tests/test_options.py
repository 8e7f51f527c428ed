"""The options of single values, there and back."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from hcpg import cli, presets, registry
from hcpg.commands.options import overridden
from hcpg.presets import differences

USUAL = presets.settings("metaworld/drawer-open", "hcpg_flow", "cpu")


def test_a_preset_differs_from_itself_in_nothing():
    assert differences(USUAL) == []


@pytest.mark.parametrize(
    ("part", "changed", "options"),
    [
        ("learner", {"target_entropy": -4.0}, ["--learner.target-entropy", "-4.0"]),
        ("selector", {"top_k": 2}, ["--selector.top-k", "2"]),
        ("evaluation_selector", {"translation": (1, 4)}, ["--evaluation-selector.translation", "1", "4"]),
        ("selector", {"bounds": None}, ["--selector.bounds", "None"]),
        ("budget", {"steps": 7, "training_horizon": 200}, None),
    ],
)
def test_the_options_of_a_difference_make_it_again(part, changed, options):
    settings = replace(USUAL, **{part: replace(getattr(USUAL, part), **changed)})
    assert options is None or differences(settings) == options
    assert overridden(USUAL, differences(settings)) == settings


def test_another_adapter_is_an_option_too():
    assert differences(replace(USUAL, adapter="contact")) == ["--adapter", "contact"]


@pytest.mark.parametrize("option", [("--preset", "q_guided"), ("--selector.rule", "value_soft")])
def test_training_refuses_a_selector_that_ranks_by_a_critic_the_method_lacks(
    option, tmp_path, monkeypatch, capsys
):
    """Before anything starts: there is not even a run folder."""
    without_critic = SimpleNamespace(Config=registry.method("sac_flow").Config, METHOD=type("Cloned", (), {}))
    monkeypatch.setattr(registry, "method", lambda _: without_critic)
    command = ["train", "--task", "point/reach", "--out", str(tmp_path), *option]
    assert cli.main(command) == 2
    assert "'sac_flow' has no critic" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
