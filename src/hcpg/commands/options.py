"""The settings behind `hcpg train`'s options: names first, then any single value, checked before training."""

from collections.abc import Sequence
from dataclasses import asdict, field, make_dataclass, replace

from hcpg import presets, registry
from hcpg.loops.schedule import Schedule
from hcpg.presets import Settings
from hcpg.registry import UnknownNameError

_NESTED = ("learner", "selector", "evaluation_selector", "budget")


def overridden(settings: Settings, options: Sequence[str]) -> Settings:
    """`settings` with single values changed, e.g. by `--learner.target-entropy 4`.

    A typo or a value out of range ends the program with a message that names the right ones.
    """
    import tyro

    changed = tyro.cli(_nested_type(settings), args=list(options), prog="hcpg train")
    return replace(settings, **{name: getattr(changed, name) for name in _NESTED})


def differences(settings: Settings) -> list[str]:
    """The options that lead from the preset to `settings`: the inverse of `overridden`, and `--adapter`."""
    usual = presets.settings(settings.task, settings.preset, settings.budget.name)
    options = [] if settings.adapter == usual.adapter else ["--adapter", settings.adapter]
    for part in _NESTED:
        values, usual_values = asdict(getattr(settings, part)), asdict(getattr(usual, part))
        for name, value in values.items():
            if value != usual_values[name]:
                words = value if isinstance(value, tuple) else [value]
                options += [f"--{part}.{name}".replace("_", "-"), *map(str, words)]
    return options


def help_text(settings: Settings) -> str:
    """Every single value that can be changed, with its default in `settings`."""
    import tyro

    parser = tyro.extras.get_parser(_nested_type(settings), prog="hcpg train")
    return parser.format_help()


def check(settings: Settings) -> None:
    """Refuse what could not be trained, before anything starts.

    Raises:
        UnknownNameError: no such task or adapter.
        RefusedTaskError: no adapter fits the task.
        UnservedSelectorError: a selector needs a critic that the method does not have.
        BudgetError: the budget cannot be carried out.
    """
    task = registry.task(settings.task)
    if settings.adapter not in task.adapters:
        raise UnknownNameError("adapter", settings.adapter, sorted(task.adapters))
    presets.refuse_unserved(settings)
    Schedule.of(settings.budget, task.horizon)


def _nested_type(settings: Settings) -> type:
    """A dataclass of the nested settings with their concrete types, for tyro to read."""
    parts = [
        (name, type(getattr(settings, name)), field(default=getattr(settings, name))) for name in _NESTED
    ]
    return make_dataclass("Settings", parts)
