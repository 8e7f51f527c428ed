"""File name -> plug-in: what is found, what is refused, and that nothing heavy is imported on the way."""

import subprocess
import sys

import pytest

from hcpg import registry
from hcpg.registry import RefusedTaskError, UnknownNameError
from hcpg.types import Spec


def test_plug_ins_are_found_by_their_file_names():
    assert "sac_flow" in registry.names("methods")
    assert "point" in registry.names("suites")
    assert {"point/reach", "point/carry", "metaworld/drawer-open"} <= set(registry.names("tasks"))
    assert not any("_" in name for name in registry.names("tasks"))
    assert not any(name.endswith("generic") for name in registry.names("tasks"))


@pytest.mark.parametrize("name", registry.names("methods"))
def test_a_method_file_has_a_config_and_a_method(name):
    module = registry.method(name)
    assert module.__name__ == f"hcpg.methods.{name}"
    assert module.METHOD(module.Config(), Spec(3, 2)).spec == (3, 2)


@pytest.mark.parametrize("name", registry.names("tasks"))
def test_a_task_file_is_the_task_of_its_name(name):
    task = registry.task(name)
    assert task.suite == name.partition("/")[0]
    assert task.suite in registry.names("suites")
    assert "paper" in task.adapters
    assert task.horizon > 0


def test_a_family_brings_tasks_without_a_file():
    assert "metaworld/reach" not in registry.names("tasks")
    assert "metaworld/reach" in registry.task_names()
    assert registry.task("metaworld/reach").suite == "metaworld"
    assert set(registry.names("tasks")) <= set(registry.task_names())
    assert len(set(registry.task_names())) == len(registry.task_names())


def test_a_task_that_no_adapter_fits_is_refused_with_the_reason():
    from hcpg.tasks.metaworld import generic

    short, reason = next(iter(generic.REFUSED.items()))
    with pytest.raises(RefusedTaskError) as refusal:
        registry.task(f"metaworld/{short}")
    assert str(refusal.value) == f"task 'metaworld/{short}' is refused: {reason}"
    assert f"metaworld/{short}" not in registry.task_names()


@pytest.mark.parametrize(
    ("ask", "wrong", "message"),
    [
        (registry.method, "sac_flo", "no method is named 'sac_flo'. Did you mean 'sac_flow'? Known: "),
        (registry.suite, "metaword", "no suite is named 'metaword'. Did you mean 'metaworld'? Known: "),
        (
            registry.task,
            "point/carrry",
            "no task is named 'point/carrry'. Did you mean 'point/carry'?",
        ),
        (registry.task, "nowhere/x", "no task is named 'nowhere/x'."),
        (registry.task, "point/generic", "no task is named 'point/generic'."),
    ],
)
def test_an_unknown_name_is_told_with_the_nearest_one(ask, wrong, message):
    with pytest.raises(UnknownNameError) as refusal:
        ask(wrong)
    assert str(refusal.value).startswith(message)


SCRIPT = """
import sys
from hcpg import registry
for name in registry.task_names():
    registry.task(name)
for name in registry.names("suites"):
    registry.suite(name)
print(sorted({"jax", "mujoco", "metaworld", "gymnasium", "torch"} & set(sys.modules)))
"""


def test_finding_every_task_and_suite_imports_no_simulator_and_no_jax():
    out = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"
