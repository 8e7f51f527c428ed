"""File name -> plug-in; nothing is imported until it is asked for.

`methods/sac_flow.py` is the method `sac_flow`; `tasks/metaworld/drawer_open.py` is the task
`metaworld/drawer-open`, and may bring variants of itself (`VARIANTS`, by short name). A suite may add a
`generic.py` beside its tasks, with the tasks that need no file of their own (`FAMILY`) and those it refuses,
each with the reason (`REFUSED`).
"""

import difflib
import importlib
import pkgutil
from types import ModuleType

from hcpg.interfaces import RobotPlugin, RobotTask, Suite, Task


class UnknownNameError(LookupError):
    """A name that no plug-in has; the message lists those there are."""

    def __init__(self, kind: str, name: str, known: list[str]) -> None:
        near = difflib.get_close_matches(name, known, n=1)
        guess = f" Did you mean {near[0]!r}?" if near else ""
        super().__init__(f"no {kind} is named {name!r}.{guess} Known: {', '.join(known)}.")

    def __str__(self) -> str:
        """The message as written, without the quotes that a LookupError would add."""
        return str(self.args[0])


class RefusedTaskError(LookupError):
    """A task that exists in its suite and that no adapter fits; the message says why."""


def names(kind: str) -> list[str]:
    """The plug-ins of one kind (`methods`, `suites`, `robots`, `tasks`): each a file or a folder, by name."""
    package = importlib.import_module(f"hcpg.{kind}")
    if kind != "tasks":
        return sorted(info.name for info in pkgutil.iter_modules(package.__path__))
    found = pkgutil.walk_packages(package.__path__, f"hcpg.{kind}.")
    modules = [info.name.removeprefix(f"hcpg.{kind}.") for info in found if not info.ispkg]
    named = [name.replace(".", "/").replace("_", "-") for name in modules]
    return sorted(name for name in named if not name.endswith("/generic"))


def method(name: str) -> ModuleType:
    """The method's module: its `Config` and its class, `METHOD`."""
    return _load("methods", name)


def suite(name: str) -> Suite:
    """The suite of that name; its simulator is imported only when an environment is made."""
    return _load("suites", name).SUITE


def robot(name: str) -> RobotPlugin:
    """The robot of that name; its driver is imported only when a robot is made."""
    return _load("robots", name).ROBOT


def robot_task(name: str) -> RobotTask:
    """What the task `suite/name` adds where an arm does it.

    Raises:
        UnknownNameError: there is no such task, or no arm does it.
    """
    if name not in robot_task_names():
        raise UnknownNameError("task of an arm", name, robot_task_names())
    return _task_file(name).ROBOT_TASK


def robot_task_names() -> list[str]:
    """Every task that an arm can do."""
    return [name for name in names("tasks") if hasattr(_task_file(name), "ROBOT_TASK")]


def task(name: str) -> Task:
    """The task `suite/name`, from its own file, a variant of one, or from its suite's generic family.

    Raises:
        UnknownNameError: no file, no variant and no family has the name.
        RefusedTaskError: the suite has the task, but no adapter fits it.
    """
    if name in names("tasks"):
        return _task_file(name).TASK
    suite_name, _, short = name.partition("/")
    variants = _variants(suite_name)
    if short in variants:
        return variants[short]
    family = _family(suite_name)
    if family is not None and short in family.REFUSED:
        raise RefusedTaskError(f"task {name!r} is refused: {family.REFUSED[short]}")
    if family is not None and short in family.FAMILY:
        return family.FAMILY[short]
    raise UnknownNameError("task", name, task_names())


def task_names() -> list[str]:
    """Every task that can be trained, variants and those of the generic families too."""
    known = names("tasks")
    for suite_name in names("suites"):
        family = _family(suite_name)
        more = [*_variants(suite_name), *(family.FAMILY if family else ())]
        known += [f"{suite_name}/{short}" for short in more]
    return sorted(set(known))


def _task_file(name: str) -> ModuleType:
    module = name.replace("/", ".").replace("-", "_")
    return importlib.import_module(f"hcpg.tasks.{module}")


def _variants(suite_name: str) -> dict[str, Task]:
    files = [_task_file(name) for name in names("tasks") if name.startswith(f"{suite_name}/")]
    return {short: task for file in files for short, task in getattr(file, "VARIANTS", {}).items()}


def _family(suite_name: str) -> ModuleType | None:
    if suite_name not in names("suites"):
        return None
    package = importlib.import_module(f"hcpg.tasks.{suite_name}")
    has_family = any(info.name == "generic" for info in pkgutil.iter_modules(package.__path__))
    return importlib.import_module(f"{package.__name__}.generic") if has_family else None


def _load(kind: str, name: str) -> ModuleType:
    known = names(kind)
    if name not in known:
        raise UnknownNameError(kind.removesuffix("s"), name, known)
    return importlib.import_module(f"hcpg.{kind}.{name}")
