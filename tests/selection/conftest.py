"""The scenes and proposals that the selection tests share."""

import jaxtyping
import numpy as np
import pytest

from hcpg.selection import Scene


@pytest.fixture
def unchecked():
    """Switch the shape checker of the tests off, so that the package's own errors are seen."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture
def generator():
    return np.random.default_rng(0)


@pytest.fixture
def flagged_scene():
    """Tool, object and goal half a metre apart, and a flag that says: no contact yet."""
    tool, thing, goal = np.array([0.0, 0.0, 0.0]), np.array([0.5, 0.0, 0.0]), np.array([0.5, 0.5, 0.0])
    return Scene.of(tool, thing, goal, contact=np.array(0.0))
