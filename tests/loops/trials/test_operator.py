"""The person at the terminal: nothing typed ahead counts, and an end of the input is a fault."""

import os
import threading
import time

import pytest

from hcpg.loops.trials.operator import Console, Nobody, NobodyThereError, Opinion


@pytest.fixture
def pipe():
    reading, writing = os.pipe()
    yield reading, writing
    os.close(reading)


def later(writing, text, delay_s=0.05):
    def write():
        time.sleep(delay_s)
        os.write(writing, text)

    thread = threading.Thread(target=write)
    thread.start()
    return thread


def test_what_was_typed_ahead_does_not_start_the_arm(pipe, capsys):
    reading, writing = pipe
    os.write(writing, b"\n\n\n")
    calls = []

    def stopped():
        calls.append(1)
        return "enough" if len(calls) == 3 else ""

    assert not Console(True, reading).ready("Trial 1 of 4 (BCDF)", 17, stopped)
    assert len(calls) == 3
    assert capsys.readouterr().out == (
        "Trial 1 of 4 (BCDF): lay out start state 17 and step back. Scene ready? [Enter] "
    )
    os.close(writing)


def test_enter_after_the_question_does(pipe):
    reading, writing = pipe
    thread = later(writing, b"\n")
    assert Console(False, reading).ready("Trial 1", 17, str)
    thread.join()
    os.close(writing)


def test_the_end_of_the_input_is_a_fault(pipe):
    reading, writing = pipe
    os.write(writing, b"\n")
    os.close(writing)
    with pytest.raises(NobodyThereError, match="nobody watches the arm"):
        Console(True, reading).ready("Trial 1", 17, str)


def test_only_the_three_answers_are_taken(pipe, capsys):
    reading, writing = pipe
    threads = [later(writing, text, 0.1 * place) for place, text in enumerate((b"yes\n", b"Y\n"), 1)]
    assert Console(True, reading).opinion("Trial 1") == Opinion(True, "")
    threads += [
        later(writing, text, 0.1 * place) for place, text in enumerate((b"i\n", b"Cable caught\n"), 1)
    ]
    assert Console(True, reading).opinion("Trial 2") == Opinion(None, "the operator: cable caught")
    for thread in threads:
        thread.join()
    assert capsys.readouterr().out.count("Trial 1: is the task done?") == 2
    os.close(writing)


def test_nobody_is_ready_and_has_no_opinion():
    assert Nobody().ready("Trial 1", 17, str)
    assert not Nobody().ready("Trial 1", 17, lambda: "signal SIGINT")
    assert Nobody().opinion("Trial 1") == Opinion(None, "")
