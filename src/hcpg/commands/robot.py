"""`hcpg robot`: look at an arm, run episodes on it, or inject faults into a twin."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from hcpg import registry
from hcpg.commands import robot_drill, robot_learning, robot_replay, robot_trials
from hcpg.commands.arms import announced, arm_action
from hcpg.commands.served_twin import add_serve, serving
from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.proposing import uniform
from hcpg.loops.control.records import EpisodeResult
from hcpg.loops.control.sessions import Session
from hcpg.loops.control.step_log import plain
from hcpg.loops.control.watching import Watched, watch
from hcpg.robot_types import RobotError
from hcpg.selection import RULES, Selector

STEPS = "steps.jsonl"


def run(arguments: Sequence[str]) -> int:
    """Carry out `check`, `run` or `drill`; gives the exit code."""
    options = _parser().parse_args(arguments)
    return options.carry_out(options)


def _check(options: argparse.Namespace) -> int:
    """0 where the robot is ready."""
    with TemporaryDirectory() as folder, serving(options, Path(folder)):
        rig = announced(options)
        with closing(rig.stage):
            seen = watch(rig.robot, options.seconds)
    sys.stdout.writelines(f"{line}\n" for line in _watched_lines(seen, options.seconds))
    if options.out is not None:
        options.out.write_text(json.dumps(plain(seen), indent=2) + "\n")
    return int(not seen.sound) if seen.signal is None else 128 + seen.signal


def _run(options: argparse.Namespace) -> int:
    """0 where every episode was run, 128 + the signal where one stopped it, else 1."""
    chooser = _chooser(options)
    task, address = registry.robot_task(options.task), registry.task(options.task)
    options.out.mkdir(parents=True, exist_ok=True)
    with serving(options, options.out):
        rig = announced(options)
        session = Session.of(rig, task, chooser, options.out / STEPS, options.horizon or address.horizon)
        with closing(rig.stage):
            done = session.run(range(options.start, options.start + options.episodes))
    kind = registry.robot(options.robot).kind
    sys.stdout.writelines(f"{kind}: {_episode_line(each)}\n" for each in done.episodes)
    sys.stdout.write(f"ended early: {done.ended}\n" if done.ended else "")
    sys.stdout.write(f"every step in {options.out / STEPS}\n")
    return int(bool(done.ended)) if done.signal is None else 128 + done.signal


def _chooser(options: argparse.Namespace) -> Chooser:
    """Random proposals with the selector that the options name, or an exported policy with its own.

    Raises:
        RobotError: the policy is one for another task.
    """
    adapters, size = registry.task(options.task).adapters, registry.robot_task(options.task).action_size
    if options.policy is None:
        selector = Selector(rule=options.selector, candidates=options.candidates)
        propose = partial(uniform, options.seed, size)
        return Chooser(propose, selector, adapters[options.adapter], size, options.seed)
    from hcpg.loops.control.deployed import Policy

    policy = Policy.load(options.policy)
    if policy.task != options.task:
        raise RobotError(f"the policy in {options.policy} is one for {policy.task}, not for {options.task}")
    read_scene = adapters[policy.adapter]
    return Chooser(policy.proposer(options.seed), policy.selector, read_scene, size, options.seed)


def _watched_lines(seen: Watched, seconds: float) -> Iterator[str]:
    versions = "".join(f", {name} {version}" for name, version in seen.info.versions.items())
    yield f"connected to {seen.info.name} ({seen.info.kind}){versions}"
    for check in seen.info.checks:
        mark, cure = ("ok", "") if check.passed else ("FAILED", f"; {check.cure}")
        yield f"  {mark:6}  {check.name}: {check.found}{cure}"
    timing = seen.timing
    yield f"held for {seconds:g} s: {timing.ticks} ticks, {timing.skipped} deadlines missed"
    late = (timing.lateness_p50_ms, timing.lateness_p99_ms, timing.lateness_max_ms)
    yield "lateness p50 {:.3f}, p99 {:.3f}, max {:.3f} ms".format(*late)
    yield f"slowest tick {seen.body_max_ms:.2f} ms, oldest state {seen.state_age_max_ms:.1f} ms"
    yield f"lowest success rate {seen.success_rate_min:.2f}, modes {', '.join(seen.modes)}"
    yield f"moved {seen.moved_mm:.2f} mm, {seen.outside_mm:.1f} mm outside the box"
    yield "ready" if seen.sound else "not ready: see above"


def _episode_line(result: EpisodeResult) -> str:
    steps = f" after {result.steps_to_success} actions" if result.ended == "success" else ""
    timing = "" if result.timing.sound else f"; timing unsound, {result.timing.skipped} deadlines missed"
    told = f"start {result.start}: {result.ended}{steps} ({result.verdict.cause})"
    return f"{told}, {result.actions} actions, {result.held} held{timing}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hcpg robot",
        description="An arm at 30 Hz, or its twin. Limits are on unless the robot's file says so.",
    )
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    check = arm_action(actions, "check", _check, "connect, check, hold still, let go")
    add_serve(check)
    check.add_argument("--seconds", type=float, default=2.0, help="how long to hold; default: 2")
    check.add_argument("--out", type=Path, metavar="FILE", help="what was found, as JSON")
    play = arm_action(actions, "run", _run, "episodes of an exported policy, or of random proposals")
    add_serve(play)
    play.add_argument("--policy", type=Path, metavar="FOLDER", help="what `hcpg export` wrote")
    play.add_argument("--selector", choices=RULES, default="hcpg")
    play.add_argument("--candidates", type=int, default=4, help="proposals per action (K); default: 4")
    play.add_argument("--adapter", default="paper", help="scene reader; default: paper")
    play.add_argument("--start", type=int, default=0, help="the first start state; default: 0")
    play.add_argument("--episodes", type=int, default=1)
    play.add_argument("--horizon", type=int, help="most actions of an episode; default: the task's")
    play.add_argument("--seed", type=int, default=0, help="of the proposals; default: 0")
    play.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where the steps are written")
    robot_drill.add(actions)
    robot_learning.add(actions)
    robot_trials.add(actions)
    robot_replay.add(actions)
    return parser
