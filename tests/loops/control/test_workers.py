import threading

import pytest

from hcpg.loops.control.workers import InlineWorker, ThreadWorker, worker_for
from hcpg.robots.point import JumpingClock
from hcpg.safety.clock import MachineClock


def test_an_inline_call_is_answered_within_its_time():
    clock = JumpingClock()
    worker = InlineWorker(clock)

    def slow():
        clock.sleep_until(clock.now_s() + 0.02)
        return 7

    assert worker.ask(3, slow) is True
    answer = worker.answer(3, 0.025)
    assert (answer.value, answer.error, answer.took_s) == (7, None, pytest.approx(0.02))
    assert worker.answer(4, 0.025) is None  # another ticket's
    assert worker.answer(3, 0.019) is None  # it was late


def test_what_a_call_raises_is_its_answer():
    worker = InlineWorker(JumpingClock())
    worker.ask(1, lambda: [][0])
    assert isinstance(worker.answer(1, 1.0).error, IndexError)


@pytest.fixture
def threaded():
    worker = ThreadWorker(MachineClock(), "test")
    yield worker
    worker.close()
    worker.close()


def soon():
    return MachineClock().now_s() + 5.0


def test_a_thread_takes_one_call_at_a_time_and_queues_none(threaded):
    may_end = threading.Event()
    assert threaded.ask(1, lambda: may_end.wait(5)) is True
    assert threaded.ask(2, lambda: 2) is False
    assert threaded.answer(1, MachineClock().now_s()) is None  # not ready, and not waited for
    may_end.set()
    assert threaded.answer(1, soon()).value is True
    assert threaded.ask(3, lambda: 3) is True
    assert threaded.answer(3, soon()).value == 3


def test_a_late_answer_is_never_read_under_another_ticket(threaded):
    threaded.ask(1, lambda: "old")
    assert threaded.answer(1, soon()).value == "old"
    may_end = threading.Event()
    threaded.ask(2, lambda: may_end.wait(5) and "new")
    assert threaded.answer(2, MachineClock().now_s()) is None
    may_end.set()
    assert threaded.answer(2, soon()).value == "new"
    assert threaded.answer(1, MachineClock().now_s()) is None


def test_a_closed_worker_takes_nothing(threaded):
    threaded.close()
    assert threaded.ask(1, lambda: 1) is False


def test_only_time_that_passes_by_itself_needs_a_thread():
    worker = worker_for(MachineClock(), "test")
    assert isinstance(worker, ThreadWorker)
    worker.close()
    assert isinstance(worker_for(JumpingClock(), "test"), InlineWorker)
