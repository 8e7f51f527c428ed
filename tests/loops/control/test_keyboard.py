import os
import termios

import numpy as np
import pytest

from hcpg.loops.control.keyboard import HELD_S, DeviceError, Keyboard
from hcpg.robots.point import JumpingClock

NOTHING = np.zeros(11)


@pytest.fixture
def terminal():
    """The two ends of a terminal: the person's and the program's."""
    person, program = os.openpty()
    yield person, program
    for end in (person, program):
        try:
            os.close(end)
        except OSError:  # the test closed it
            continue


def test_a_key_pushes_along_its_axis_for_a_moment(terminal):
    person, program = terminal
    clock = JumpingClock()
    with Keyboard(program, clock, 3, speed=0.5) as keys:
        assert keys(NOTHING, 2, 0).tolist() == [[0, 0, 0]] * 2
        os.write(person, b"wr")
        assert keys(NOTHING, 1, 1).tolist() == [[0.5, 0, 0.5]]
        clock.sleep_until(0.9 * HELD_S)
        assert keys(NOTHING, 1, 2).tolist() == [[0.5, 0, 0.5]]
        clock.sleep_until(1.1 * HELD_S)
        assert keys(NOTHING, 1, 3).tolist() == [[0, 0, 0]]


def test_the_grip_stays_as_it_was_said_last(terminal):
    person, program = terminal
    with Keyboard(program, JumpingClock(), 4) as keys:
        os.write(person, b"sO")
        assert keys(NOTHING, 1, 0).tolist() == [[-1, 0, 0, 1]]
        os.write(person, b"c")
        assert keys(NOTHING, 1, 1)[0, 3] == -1


def test_the_terminal_is_put_back(terminal):
    program = terminal[1]
    before = termios.tcgetattr(program)
    with Keyboard(program, JumpingClock(), 3):
        assert not termios.tcgetattr(program)[3] & termios.ICANON  # keys arrive without a line's end
    assert termios.tcgetattr(program) == before


def test_a_pipe_is_no_terminal():
    reading, writing = os.pipe()
    with pytest.raises(DeviceError, match="needs a terminal, and standard input is none"):
        Keyboard(reading, JumpingClock(), 3)
    os.close(reading)
    os.close(writing)


def test_nobody_is_left_when_the_terminal_ends(terminal):
    person, program = terminal
    keys = Keyboard(program, JumpingClock(), 3)
    os.close(person)
    with pytest.raises(DeviceError, match="EOF"):
        keys(NOTHING, 1, 0)
