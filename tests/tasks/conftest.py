"""What the tests of both simulators' adapters share."""

import importlib.util
from pathlib import Path

import pytest

from hcpg import registry

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture(scope="module")
def make(request):
    """Environments of the module's SUITE by task, each made once."""
    suite, made = request.module.SUITE, {}

    def environment(name):
        if name not in made:
            made[name] = registry.suite(suite).make(registry.task(f"{suite}/{name}"), seed=0)
        return made[name]

    yield environment
    for each in made.values():
        each.close()


@pytest.fixture(scope="module")
def controls():
    """The script with the two controls, as a module."""
    spec = importlib.util.spec_from_file_location("adapter_check", SCRIPTS / "adapter_check.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
