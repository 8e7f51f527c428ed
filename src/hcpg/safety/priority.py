"""The right to run first: what keeps 30 Hz on a machine that computes something else beside."""

import os

PRIORITY = 10
"""Of the class SCHED_FIFO, 1 to 99; drivers run their own 1 kHz threads above it."""


def raise_priority() -> str:
    """Put this thread, and those it starts from now on, before all ordinary ones; "" or why not.

    Threads that share an interpreter lock need the same priority: one that waits for a processor while it
    holds the lock would make the control thread wait, too. So call it before the others are started.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        cure = "let /etc/security/limits.conf give this user rtprio, or run as root"
        return f"no real-time priority: deadlines will be missed when the machine is busy; {cure}"
    return ""
