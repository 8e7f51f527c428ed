"""`hcpg list`: everything that can be named in a command."""

import argparse
import ast
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from hcpg import presets, registry
from hcpg.selection import RULES, Selector

KINDS = ("methods", "selectors", "tasks", "presets", "budgets", "robots")


def run(arguments: Sequence[str]) -> int:
    """Print the names of one kind, or of all."""
    parser = argparse.ArgumentParser(prog="hcpg list", description="Show what can be named in a command.")
    parser.add_argument("kind", nargs="?", choices=KINDS, help="only these; default: all")
    chosen = parser.parse_args(arguments).kind
    for kind in KINDS if chosen is None else (chosen,):
        lines = _lines(kind)
        width = max(map(len, lines))
        sys.stdout.write(f"{kind}\n")
        sys.stdout.writelines(f"  {name:{width}}  {what}".rstrip() + "\n" for name, what in lines.items())
    return 0


def _lines(kind: str) -> dict[str, str]:
    """What each name stands for, in a line."""
    if kind == "methods":
        return {name: _summary(f"hcpg.methods.{name}") for name in registry.names("methods")}
    if kind == "robots":
        return {name: _summary(f"hcpg.robots.{name}") for name in registry.names("robots")}
    if kind == "selectors":
        return dict.fromkeys(RULES, "") | {"bare": "the method's own action, without a selector"}
    if kind == "tasks":
        return {name: f"adapters {', '.join(registry.task(name).adapters)}" for name in registry.task_names()}
    if kind == "presets":
        return {name: _pair(preset) for name, preset in presets.PRESETS.items()}
    return {
        name: f"{budget.steps:,} steps, {budget.environments} environments, "
        f"{budget.updates_per_step:g} updates per step, batch {budget.batch_size}"
        for name, budget in presets.BUDGETS.items()
    }


def _pair(preset: presets.Preset) -> str:
    """The method, what selects while it trains and while it is evaluated, and which parts are exchanged."""
    at_evaluation = preset.evaluation_selector
    evaluated = "" if at_evaluation is None else f", evaluated {_selection(at_evaluation)}"
    parts = "".join(f", {name} {value}" for name, value in preset.learner.items() if isinstance(value, str))
    return f"{preset.method} {_selection(preset.selector)}{evaluated}{parts}"


def _selection(selector: Selector) -> str:
    if selector.alone:
        return "alone"
    towards = "" if selector.direction == "scene" else f", {selector.direction} directions"
    return f"with selector {selector.rule} (K = {selector.candidates}{towards})"


def _summary(module: str) -> str:
    """The first line of a module's docstring, read without importing it."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return (ast.get_docstring(ast.parse(Path(spec.origin).read_text())) or "").partition("\n")[0]
