"""What the subcommands of `hcpg robot` share: which arm, and what is said before it moves."""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import asdict

from hcpg import registry
from hcpg.interfaces import Rig
from hcpg.loops.control.workers import passes_by_itself
from hcpg.robot_types import Limits
from hcpg.safety.priority import raise_priority


def arm_action(
    actions: "argparse._SubParsersAction", name: str, carry_out: object, what: str
) -> argparse.ArgumentParser:
    """A subcommand for one task on one arm; `carry_out` takes its options and gives the exit code."""
    parser = actions.add_parser(name, help=what, description=what)
    parser.add_argument("task", metavar="TASK", help="as `hcpg list tasks` has it")
    parser.add_argument("--robot", required=True, help=f"one of: {', '.join(registry.names('robots'))}")
    parser.add_argument("--address", help="the controller's, where the robot has one")
    parser.set_defaults(carry_out=carry_out)
    return parser


def announced(options: argparse.Namespace) -> Rig:
    """The rig that the options name; says what it is and what it is held to."""
    plugin = registry.robot(options.robot)
    registry.robot_task(options.task)  # a task that no arm does is refused before any driver loads
    rig = plugin.make(options.task, options.address)
    sys.stdout.write(f"{options.robot} ({plugin.kind}), {options.task}; limits:\n")
    sys.stdout.writelines(f"  {line}\n" for line in _limit_lines(rig.robot.limits))
    return with_priority(rig)


def with_priority(rig: Rig) -> Rig:
    """The rig, and this process before ordinary ones, if the robot's time does not wait for it."""
    refused = raise_priority() if passes_by_itself(rig.robot.clock) else ""
    sys.stdout.write(f"{refused}\n" if refused else "")
    return rig


def _limit_lines(limits: Limits) -> Iterator[str]:
    width = max(map(len, asdict(limits)))
    return (f"{name:{width}}  {value}" for name, value in asdict(limits).items())
