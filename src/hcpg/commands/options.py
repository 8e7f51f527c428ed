"""The settings behind `hcpg train`'s options: names first, then any single value, checked before training."""

from collections.abc import Sequence
from dataclasses import field, make_dataclass, replace

from hcpg import presets, registry
from hcpg.loops.schedule import Schedule
from hcpg.presets import PARTS, Settings
from hcpg.registry import UnknownNameError


def overridden(settings: Settings, options: Sequence[str]) -> Settings:
    """`settings` with single values changed, e.g. by `--learner.target-entropy 4`.

    A typo or a value out of range ends the program with a message that names the right ones.
    """
    import tyro

    changed = tyro.cli(_nested_type(settings), args=list(options), prog="hcpg train")
    return replace(settings, **{name: getattr(changed, name) for name in PARTS})


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
    parts = [(name, type(getattr(settings, name)), field(default=getattr(settings, name))) for name in PARTS]
    return make_dataclass("Settings", parts)
