"""`hcpg robot demos | clone | learn`: show a task to an arm, imitate what was shown, learn on from there."""

import argparse
import json
import shlex
import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hcpg import registry
from hcpg.commands import choice
from hcpg.commands.arms import announced, arm_action
from hcpg.commands.scripted import expert
from hcpg.commands.served_twin import add_serve, serving
from hcpg.experiments import arm_budgets
from hcpg.interfaces import Rig
from hcpg.loops import demonstrations, recording
from hcpg.loops.control import gamepad, keyboard, spacemouse
from hcpg.loops.recording import Order, Source
from hcpg.safety.clock import MachineClock

if TYPE_CHECKING:
    from hcpg.loops.runs import RunFolder


class LearnOptionsError(ValueError):
    """Options of `learn` that do not belong together; the message says which to give."""


def add(actions: "argparse._SubParsersAction") -> None:
    """Declare `demos`, `clone` and `learn`."""
    demos = arm_action(actions, "demos", _demos, "record demonstrations, through all limits")
    add_serve(demos)
    demos.add_argument("--count", type=int, default=20, help="successful ones wanted; default: 20")
    demos.add_argument(
        "--source", choices=("expert", "keyboard", "gamepad", "spacemouse"), default="expert",
        help="who shows it; expert (default) is a script with noise, where the robot has one",
    )  # fmt: skip
    demos.add_argument(
        "--device", type=Path, default=gamepad.DEVICE, help=f"of the gamepad; default: {gamepad.DEVICE}"
    )
    demos.add_argument("--seed", type=int, default=0, help="of start states and noise; default: 0")
    demos.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="a new folder")
    what = "make the initial policy, for every method alike: match the flow to demonstrations"
    cloning = actions.add_parser("clone", help=what, description=what)
    cloning.set_defaults(carry_out=_clone)
    cloning.add_argument("demos", type=Path, metavar="DEMOS", help="a folder of demonstrations")
    cloning.add_argument("--preset", default="hcpg_flow", help="whose learner; default: hcpg_flow")
    cloning.add_argument("--steps", type=int, default=5000, help="of flow matching; default: 5000")
    cloning.add_argument("--critic-updates", type=int, default=2000, help="of the critics; default: 2000")
    cloning.add_argument("--seed", type=int, default=0)
    cloning.add_argument("--out", type=Path, default=Path("runs"), help="where the run goes; default: runs")
    online = arm_action(actions, "learn", _learn, "learn on the arm under a budget of executed actions")
    add_serve(online)
    online.add_argument("--initial", type=Path, metavar="RUN", help="the clone that every method starts from")
    online.add_argument("--demos", type=Path, metavar="DEMOS", help="half of every batch; never changed")
    online.add_argument(
        "--preset", default="hcpg_flow", help="the selector is what differs; default: hcpg_flow"
    )
    online.add_argument("--steps", type=int, help="executed actions in all; default: the paper's")
    online.add_argument("--updates-per-step", type=int, default=4, help="per executed action; default: 4")
    online.add_argument("--seed", type=int, default=0)
    online.add_argument("--out", type=Path, default=Path("runs"), help="where the run goes; default: runs")
    online.add_argument(
        "--resume", type=Path, metavar="RUN", help="go on with a run; what was spent stays spent"
    )


def _demos(options: argparse.Namespace) -> int:
    """0 where as many were recorded as wanted, 128 + the signal where one stopped it, else 1."""
    plugin = registry.robot(options.robot)
    order = Order(options.task, options.robot, plugin.kind, options.count, options.seed)
    with serving(options, options.out.parent):
        rig = announced(options)
        with closing(rig.stage):
            done = recording.record(order, rig, _source(options, order, rig), options.out, _command())
    good = sum(each.ended == "success" for each in done.episodes)
    sys.stdout.write(f"{plugin.kind}: {good} of {len(done.episodes)} episodes succeeded and are kept\n")
    sys.stdout.write(f"ended early: {done.ended}\n" if done.ended else "")
    sys.stdout.write(f"demonstrations in {options.out}\n")
    return int(bool(done.ended)) if done.signal is None else 128 + done.signal


def _clone(options: argparse.Namespace) -> int:
    """0 once the clone is stored."""
    task = demonstrations.task_of(options.demos)
    shown = demonstrations.load(options.demos, task)
    programs = choice.prepare()
    from hcpg.loops import cloning

    settings = arm_budgets.settings(task, options.preset)
    recipe = cloning.Recipe(steps=options.steps, critic_updates=options.critic_updates)
    folder = cloning.clone(settings, shown, recipe, options.seed, options.out)
    found = json.loads((folder.path / cloning.FACTS).read_text())["found"]
    sys.stdout.writelines(f"{name} {value:.4f}\n" for name, value in found.items())
    sys.stdout.write(f"{folder.path}\n")
    if programs is not None:
        programs.close()
    return 0


def _learn(options: argparse.Namespace) -> int:
    """0 where the budget is spent, 128 + the signal where one stopped it, else 1."""
    if options.resume is None and None in (options.initial, options.demos):
        raise LearnOptionsError("give --initial and --demos for a new run, or --resume RUN to continue one")
    programs = choice.prepare()
    from hcpg.loops import online

    folder = _resumed(options) if options.resume else _begun(options)
    sys.stdout.write(f"{folder.path}\n")
    with folder.lock(), serving(options, folder.path):
        rig = announced(options)
        with closing(rig.stage):
            done = online.OnlineRun(folder, rig, _say).run()
    _say(
        f"ended early: {done.ended}; go on with --resume {folder.path}"
        if done.ended
        else "the budget is spent"
    )
    if programs is not None:
        programs.close()
    return int(bool(done.ended)) if done.signal is None else 128 + done.signal


def _begun(options: argparse.Namespace) -> "RunFolder":
    from hcpg.loops import online
    from hcpg.loops.trained import Choice, load

    shown = demonstrations.load(options.demos, options.task)
    settings = arm_budgets.settings(options.task, options.preset, options.steps, options.updates_per_step)
    sources = online.Sources(load(options.initial, Choice()), options.demos, shown.digest)
    return online.begin(settings, options.seed, options.out, sources)


def _resumed(options: argparse.Namespace) -> "RunFolder":
    from hcpg.loops import online
    from hcpg.loops.runs import RunFolder

    folder = RunFolder.open(options.resume)
    facts, task = online.facts_of(folder), folder.config()["task"]
    if task != options.task:
        raise LearnOptionsError(f"{folder.path} learns {task}, not {options.task}")
    shown = demonstrations.load(Path(facts["demonstrations"]["path"]), task)
    if shown.digest != facts["demonstrations"]["sha256"]:
        raise LearnOptionsError(f"{shown.path} holds other demonstrations than {folder.path} began with")
    return folder


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _source(options: argparse.Namespace, order: Order, rig: Rig) -> Source:
    size = registry.robot_task(order.task).action_size
    if options.source == "expert":
        return recording.scripted(partial(expert, order.task, rig.stage), order.seed)
    facts = {"name": options.source, "stand_in": None}
    if options.source == "gamepad":
        sys.stdout.write(f"{gamepad.HELP}\n")
        return Source(gamepad.Gamepad(size, device=options.device), facts)
    if options.source == "spacemouse":
        sys.stdout.write(f"{spacemouse.HELP}\n")
        return Source(spacemouse.SpaceMouse(size), facts)
    sys.stdout.write(f"{keyboard.HELP}\n")
    return Source(keyboard.Keyboard(sys.stdin.fileno(), MachineClock(), size), facts)


def _command() -> str:
    return shlex.join(["hcpg", *sys.argv[1:]])
