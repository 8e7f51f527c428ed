"""The served twin's third port: what is told arrives, requests are taken once, silence is known as such."""

import os
import threading
import time

import numpy as np
import pytest

from hcpg.robot_types import RobotError
from hcpg.twin.bench import Bench
from hcpg.twin.channel import Listener, Teller
from hcpg.twin.physics import Physics
from hcpg.twin.scenes import SCENES

pytest.importorskip("mujoco")
ADDRESS = f"127.{os.getpid() % 250 + 1}.{os.getpid() // 250 % 250 + 1}.9{os.getpid() % 10}"


@pytest.fixture(scope="module")
def bench():
    physics = Physics(SCENES["drawer-closing"])
    bench = Bench("drawer-closing", 0, physics.model, physics.data)
    physics.lay_out(bench.layout(4))
    bench.begin(bench.layout(4))
    return bench


@pytest.fixture
def both_ends():
    teller, listener = Teller(ADDRESS), Listener(ADDRESS)
    yield teller, listener
    listener.close()
    teller.close()


def eventually(condition):
    until_s = time.monotonic() + 2.0
    while not condition():
        assert time.monotonic() < until_s
        time.sleep(0.01)


def test_the_truth_arrives_as_it_was_told(both_ends, bench):
    teller, listener = both_ends
    teller.say(bench, ticket=0)
    eventually(listener.surveyed)
    told, true = listener.truth(), bench.truth()
    assert (told.reach_m, told.progress) == (true.reach_m, 0.0)
    assert (told.holds, told.done) == (False, False)
    np.testing.assert_array_equal(told.object, true.object)
    np.testing.assert_array_equal(listener.surveyed()["cabinet"], bench.surveyed()["cabinet"])
    np.testing.assert_array_equal(listener.moving()["drawer"], true.object)


def test_a_request_is_taken_up_by_whoever_runs_the_physics(both_ends, bench):
    teller, listener = both_ends
    starts = []

    def take():
        request = teller.requests.get(timeout=2.0)
        teller.say(bench, request.ticket)
        starts.append(request.start)

    running = threading.Thread(target=take)
    running.start()
    listener.arrange(17)
    running.join()
    assert starts == [17]


def test_silence_is_not_taken_for_an_answer(both_ends):
    _, listener = both_ends
    assert listener.moving() == {}
    with pytest.raises(RobotError, match="tells nothing; is it running"):
        listener.truth()
    with pytest.raises(RobotError, match="lays out nothing"):
        listener.arrange(1)
