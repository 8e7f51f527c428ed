"""A trained run as a contender; the run is the one tiny run of these tests."""

import hashlib

import numpy as np
import pytest

from hcpg.loops import checkpoints
from hcpg.loops.trained import Choice
from hcpg.loops.trials.plan import PlanError
from hcpg.loops.trials.trained_policies import trained


@pytest.fixture(scope="module")
def contender(straight):
    return trained(straight[0].path, Choice(), "point/reach", 0)


def test_it_is_named_by_its_checkpoint(straight, contender):
    newest = checkpoints.latest(straight[0].checkpoints)
    digest = hashlib.sha256((newest / "facts.json").read_bytes()).hexdigest()
    facts = contender.facts
    assert (facts["sha256"], facts["step"], facts["acts"]) == (digest, 240, "hcpg")
    assert facts["selector"]["candidates"] == 4


def test_its_draws_follow_from_the_start_state_alone(contender):
    observation = np.linspace(0, 0.1, 11, dtype=np.float32)
    first = [contender.chooser(17).choose(observation, draw, False) for draw in range(3)]
    again = [contender.chooser(17).choose(observation, draw, False) for draw in range(3)]
    other = contender.chooser(18).choose(observation, 0, False)
    assert all((one.action == two.action).all() for one, two in zip(first, again, strict=True))
    assert first[0].proposals.shape == (4, 4)
    assert np.abs(first[0].proposals - first[1].proposals).max() > 1e-3
    assert np.abs(first[0].proposals - other.proposals).max() > 1e-3


def test_bare_it_proposes_once(straight):
    bare = trained(straight[0].path, Choice(selector="bare"), "point/reach", 0)
    found = bare.chooser(17).choose(np.zeros(11, np.float32), 0, False)
    assert found.proposals.shape == (1, 4)
    assert (bare.facts["acts"], bare.facts["selector"]["candidates"]) == ("bare", 1)


def test_a_run_of_another_task_is_refused(straight):
    with pytest.raises(PlanError, match="learned point/reach, not point/carry"):
        trained(straight[0].path, Choice(), "point/carry", 0)
