"""The learner behind a pipe: it learns what it is given, and its death is told."""

import os
import signal

import numpy as np
import pytest
from test_online import PER_ACTION, begun

from hcpg.loops.control.experience import Experience
from hcpg.loops.demonstrations import DemonstrationFolder
from hcpg.loops.learner_process import LearnerError, LearnerProcess
from hcpg.types import Batch


def episode(number, actions):
    generator = np.random.default_rng(number)
    seen = generator.normal(size=(actions, 11))
    rows = [seen, generator.uniform(-1, 1, (actions, 4)), np.zeros(actions), seen, np.zeros(actions)]
    batch = Batch(*(each.astype(np.float32) for each in rows))
    return Experience(number, number, "success", actions, batch, {})


@pytest.fixture
def process(tmp_path):
    DemonstrationFolder(tmp_path / "demos", {"task": "point/reach"}).add(episode(0, 20))
    run = begun(tmp_path / "runs").path
    started = LearnerProcess(run, tmp_path / "demos", "point/reach", tmp_path / "learner.txt")
    yield started
    started.close()


def test_it_learns_what_it_is_given_until_it_dies(process):
    def never():
        return False

    ready = process.word(never)
    assert (ready.progress.executed, ready.row) == (0, {})
    process.give(episode(0, 3))
    told = process.word(never)
    assert (told.progress.executed, told.progress.updates) == (3, 3 * PER_ACTION)
    assert told.row["step"] == 3
    assert process.word(never) is None  # nothing is owed
    os.kill(process._process.pid, signal.SIGKILL)
    process._process.join()
    assert not process.alive()
    process.give(episode(1, 3))
    with pytest.raises(LearnerError, match="its process died"):
        process.word(never)
