"""`hcpg robot trials`: policies tried on an arm or its twin, in an order that the operator does not know."""

import argparse
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hcpg import registry
from hcpg.commands import choice
from hcpg.commands.arms import announced
from hcpg.commands.scripted import expert, referee_of
from hcpg.commands.served_twin import add_serve, serving
from hcpg.interfaces import Rig
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.deployed.parcel import POLICY
from hcpg.loops.trials.contenders import ALONE, BARE, Contender, chance, exported
from hcpg.loops.trials.ledger import Ledger
from hcpg.loops.trials.operator import Console, Nobody, NobodyThereError
from hcpg.loops.trials.plan import Plan, PlanError
from hcpg.loops.trials.running import Arena, run_trials
from hcpg.registry import UnknownNameError
from hcpg.selection import RULES, Selector

DESCRIPTION = """Try policies on one task of an arm or its twin: every policy from the same start states, in
an order that is drawn, shown to the operator by codes alone. Give the same command again to go on after a
stop; a changed plan is refused. Without TASK, --report DIR makes the table of all tasks under DIR."""
EXPERT, CHANCE = "expert", "uniform"
STOPPED_BY_HAND = 130


def add(actions: "argparse._SubParsersAction") -> None:
    """Declare the subcommand."""
    parser = actions.add_parser("trials", help="try policies, blind and in turn", description=DESCRIPTION)
    add_option = parser.add_argument
    add_option("task", metavar="TASK", nargs="?", help="as `hcpg list tasks` has it")
    add_option("--robot", help=f"one of: {', '.join(registry.names('robots'))}")
    add_option("--address", help="the controller's, where the robot has one")
    add_serve(parser)
    add_option("--policy", action="append", default=[], metavar="NAME=WHAT", help=_POLICY)
    add_option("--selector", action="append", default=[], metavar="NAME=RULE", help=_SELECTOR)
    add_option("--adapter", help="scene reader; default: the run's own, or paper")
    add_option("--trials", type=int, default=15, help="of every policy; default: 15")
    add_option("--seed", type=int, default=0, help="draws starts, order, codes and actions; default: 0")
    add_option("--out", type=Path, metavar="FOLDER", help="of all tasks; each has a folder of its own in it")
    add_option("--unattended", action="store_true", help="on a twin: nobody is asked, its physics judges")
    add_option("--report", type=Path, metavar="DIR", help="write and print the table of the trials under DIR")
    parser.set_defaults(carry_out=carry_out)


_POLICY = (
    f"a run folder, a checkpoint, what `hcpg export` wrote, `{EXPERT}` (a twin's scripted expert) or "
    f"`{CHANCE}`; once for each policy, in the order in which the table shall compare them"
)
_SELECTOR = f"how the policy NAME selects: one of {', '.join(RULES)}, or bare; default: the run's own"


def carry_out(options: argparse.Namespace) -> int:
    """0 where every trial is done, 128 + the signal where one stopped it, else 1."""
    if options.report is not None:
        return _report(options)
    missing = [name for name in ("task", "robot", "out") if getattr(options, name) is None]
    if missing:
        words = ", ".join(name if name == "task" else f"--{name}" for name in missing)
        raise PlanError(f"trials need {words}; or give --report DIR for the table of trials that were run")
    kind = registry.robot(options.robot).kind
    if options.unattended and kind != "twin":
        raise PlanError("only a twin runs unattended; somebody has to stand beside an arm")
    with serving(options, options.out / options.task), _prepared(options):
        rig = announced(options)
        with closing(rig.stage):
            return _run(options, rig)


def _run(options: argparse.Namespace, rig: Rig) -> int:
    contenders = _contenders(options, rig)
    plan = _plan(options, rig, contenders)
    with Ledger(options.out / options.task, plan) as ledger:
        sys.stdout.write(f"plan {ledger.digest}: {ledger.size} trials in {ledger.folder}\n")
        try:
            progress = run_trials(_arena(options, rig, plan, contenders), ledger, _tell)
        except KeyboardInterrupt:
            return STOPPED_BY_HAND
        except NobodyThereError as error:
            sys.stderr.write(f"\nfault: {error}\n")
            return 1
    early = f"ended early: {progress.ended}; the same command goes on"
    sys.stdout.write(f"{early if progress.ended else 'all done'}\n")
    return int(bool(progress.ended)) if progress.signal is None else 128 + progress.signal


@contextmanager
def _prepared(options: argparse.Namespace) -> Iterator[None]:
    """JAX set up as training was, where a policy was trained; without one it is never imported."""
    chosen = _pairs("--policy", options.policy).values()
    needs_jax = any(what not in (EXPERT, CHANCE) and not _is_exported(Path(what)) for what in chosen)
    programs = choice.prepare() if needs_jax else None
    yield
    if programs is not None:
        programs.close()


def _plan(options: argparse.Namespace, rig: Rig, contenders: Mapping[str, Contender]) -> Plan:
    return Plan(
        task=options.task,
        robot=options.robot,
        kind=registry.robot(options.robot).kind,
        served=options.address is not None,
        limits=rig.robot.limits,
        horizon=registry.task(options.task).horizon,
        seed=options.seed,
        trials=options.trials,
        policies={name: contender.facts for name, contender in contenders.items()},
    )


def _arena(options: argparse.Namespace, rig: Rig, plan: Plan, contenders: Mapping[str, Contender]) -> Arena:
    lays_out = plan.kind == "twin"
    return Arena(
        rig=rig,
        task=registry.robot_task(options.task),
        choosers={name: contender.chooser for name, contender in contenders.items()},
        operator=Nobody() if options.unattended else Console(lays_out=not lays_out),
        lays_out=lays_out,
        referee=referee_of(options.task, rig.stage),
        horizon=plan.horizon,
    )


def _contenders(options: argparse.Namespace, rig: Rig) -> dict[str, Contender]:
    chosen, selectors = _pairs("--policy", options.policy), _pairs("--selector", options.selector)
    for name in selectors:
        if name not in chosen:
            raise UnknownNameError("policy", name, list(chosen))
    return {name: _contender(options, rig, what, selectors.get(name)) for name, what in chosen.items()}


def _contender(options: argparse.Namespace, rig: Rig, what: str, rule: str | None) -> Contender:
    task, adapter = options.task, options.adapter or "paper"
    if what == CHANCE:
        return chance(registry.task(task), registry.robot_task(task), _selector(rule), adapter, options.seed)
    if what == EXPERT:
        size, selector = registry.robot_task(task).action_size, _selector(rule)
        propose, read_scene = expert(task, rig.stage), registry.task(task).adapters[adapter]
        facts = {"source": "scripted expert, which sees the truth", "selector": asdict(selector)}
        return Contender(
            facts, lambda start: Chooser(propose, selector, read_scene, size, options.seed + start)
        )
    if _is_exported(Path(what)):
        return exported(Path(what), _known(rule), registry.task(task), task, options.seed)
    from hcpg.loops.trained import Choice
    from hcpg.loops.trials.trained_policies import trained

    return trained(Path(what), Choice(rule, None, options.adapter), task, options.seed)


def _selector(rule: str | None) -> Selector:
    """For proposals that nothing learned; without a rule there is nothing to choose."""
    known = _known(rule)
    return ALONE if known in (None, BARE) else Selector(known)


def _known(rule: str | None) -> Any:
    if rule not in (None, BARE, *RULES):
        raise UnknownNameError("selector", str(rule), [*RULES, BARE])
    return rule


def _is_exported(path: Path) -> bool:
    return (path / POLICY).exists()


def _pairs(option: str, words: Sequence[str]) -> dict[str, str]:
    """NAME=WHAT, by name."""
    found: dict[str, str] = {}
    for word in words:
        name, equals, what = word.partition("=")
        if not (name and equals and what) or name in found:
            raise PlanError(f"{option} {word}: write NAME=WHAT, each name once")
        found[name] = what
    return found


def _tell(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _report(options: argparse.Namespace) -> int:
    from hcpg.report.trial_files import write_figure, write_tables
    from hcpg.report.trial_records import find_studies

    command = shlex.join(["hcpg", "robot", "trials", "--report", str(options.report)])
    studies, out = find_studies(options.report), options.out or options.report
    text, files = write_tables(studies, out, command)
    files += write_figure(studies, out, command)
    sys.stdout.write("".join([text, "\n", *(f"{file}\n" for file in files)]))
    return 0
