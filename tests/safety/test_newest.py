import queue

import pytest

from hcpg.safety.newest import Newest


def test_the_first_value_is_there_at_once_and_the_newest_soon():
    values = queue.Queue()
    values.put(1)
    newest = Newest(values.get, "test")
    assert newest.value == 1  # the thread now waits inside `get`; looking does not
    values.put(2)
    values.put(3)
    while newest.value != 3:
        pass
    values.put(4)
    assert newest.close(5.0)


def test_a_read_that_raises_leaves_the_last_value_and_its_error():
    answers = iter([7, ConnectionError("gone")])

    def read():
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    newest = Newest(read, "test")
    assert newest.close(5.0)
    assert newest.value == 7
    assert str(newest.error) == "gone"


def test_a_first_read_that_raises_is_the_callers():
    with pytest.raises(OSError, match="no robot"):
        Newest(lambda: (_ for _ in ()).throw(OSError("no robot")), "test")


def test_a_read_that_hangs_does_not_hang_the_close():
    values = queue.Queue()
    values.put(1)
    newest = Newest(values.get, "test")
    assert newest.close(0.01) is False
    assert newest.value == 1
    values.put(2)
    assert newest.close(5.0)
