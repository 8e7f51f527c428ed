import os
import threading

from hcpg.safety import priority


def raised():
    """What a thread of its own is told, its scheduling class, and that of a thread it starts."""
    found = []

    def look():
        found.append(priority.raise_priority())
        found.append(os.sched_getscheduler(0))
        child = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
        child.start()
        child.join()

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    return found


def test_it_is_given_and_inherited_or_the_cure_is_told():
    told, own, childs = raised()
    expected = os.SCHED_OTHER if told else os.SCHED_FIFO
    assert own == childs == expected
    assert os.sched_getscheduler(0) == os.SCHED_OTHER  # this thread is as before


def test_without_the_right_the_cure_is_told(monkeypatch):
    def refused(*_):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert "rtprio" in raised()[0]
