"""A run taken from its folder to be looked at: its settings, the state of a checkpoint, another selector."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from hcpg import presets, registry
from hcpg.interfaces import Method, ReadScene
from hcpg.loops import learning
from hcpg.loops.checkpoints import step_of
from hcpg.loops.evaluation import BARE
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import stack
from hcpg.loops.saving import load_state
from hcpg.loops.sitting import seed_of
from hcpg.loops.streams import Stream, key
from hcpg.presets import Settings
from hcpg.registry import UnknownNameError
from hcpg.selection import RULES, Selector


class Choice(NamedTuple):
    """How a trained run shall act."""

    selector: str | None = None
    """A rule's name or `bare`; None is the run's own evaluation selector."""
    candidates: int | None = None
    """Proposals per action (K); None is the run's own, or 4 where that has only one."""
    adapter: str | None = None
    """Scene reader; None is the run's own."""
    step: int | None = None
    """Which checkpoint; None is the newest."""


class Trained(NamedTuple):
    """A run as it was at a checkpoint."""

    folder: RunFolder
    seed: int
    settings: Settings
    """The run's, with the chosen evaluation selector and adapter."""
    name: str
    """What acts: the evaluation selector's rule, or `bare`, also where it has one proposal only."""
    method: Method
    read_scene: ReadScene
    states: Any
    """The method's state, with a run axis of length 1."""
    step: int
    """Environment steps at the checkpoint."""


def load(path: Path, choice: Choice) -> Trained:
    """The run (or the run of the checkpoint) at `path`.

    Raises:
        RunFolderError: there is no run.
        CheckpointError: it has no such checkpoint, or a damaged one.
        UnknownNameError: no rule or adapter has the name.
        UnservedSelectorError: the rule needs a critic that the method does not have.
    """
    folder = RunFolder.open(path)
    settings = presets.from_json(folder.config())
    task = registry.task(settings.task)
    adapter = choice.adapter or settings.adapter
    if adapter not in task.adapters:
        raise UnknownNameError("adapter", adapter, sorted(task.adapters))
    selector = _selector(settings.evaluation_selector, choice)
    settings = replace(settings, adapter=adapter, evaluation_selector=selector)
    presets.refuse_unserved(settings)
    method = registry.method(settings.method).METHOD(settings.learner, registry.suite(task.suite).spec(task))
    seed = seed_of(folder)
    step = choice.step if choice.step is not None or path.name[:5] != "step_" else step_of(path)
    state, found = load_state(folder, learning.initial(method)(key(seed, Stream.NETWORKS)), step)
    name = BARE if choice.selector == BARE or selector.alone else selector.rule
    return Trained(folder, seed, settings, name, method, task.adapters[adapter], stack([state]), found)


def _selector(own: Selector, choice: Choice) -> Selector:
    """The run's own selector, or the same settings under another rule."""
    if choice.selector not in (None, BARE, *RULES):
        raise UnknownNameError("selector", choice.selector, [*RULES, BARE])
    rule = own.rule if choice.selector in (None, BARE) else choice.selector
    others = own.candidates if own.candidates > 1 else Selector().candidates
    usual = own.candidates if rule == own.rule else others
    return replace(own, rule=rule, candidates=choice.candidates or usual)
