import os
import signal
import threading

from point_rig import new_rig

from hcpg.loops.control.stopping import StopButton


def test_the_first_reason_stays_and_the_robot_is_stopped_each_time():
    arm = new_rig().robot
    arm.connect(1.0)
    button = StopButton(arm)
    epoch = arm.observe().epoch
    button.press("too fast")
    button.press("too slow")
    assert button.reason == "too fast"
    assert arm.observe().epoch == epoch + 2
    assert arm.recover(1.0).recovered is False


def test_a_signal_presses_it_and_the_handlers_come_back():
    arm = new_rig().robot
    arm.connect(1.0)
    before = signal.getsignal(signal.SIGTERM)
    with StopButton(arm) as button:
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
    assert (button.reason, button.signal) == ("signal SIGTERM", signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is before
    assert arm.recover(1.0).recovered is False


def test_in_another_thread_it_leaves_the_signals_alone():
    handlers = []

    def enter():
        with StopButton(new_rig().robot):
            handlers.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join(5)
    assert handlers == [signal.getsignal(signal.SIGINT)]
