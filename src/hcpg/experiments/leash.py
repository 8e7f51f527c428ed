"""`python -m hcpg.experiments.leash PID ARGUMENT...`: `hcpg` that saves and ends when process PID dies.

Ray kills a job's process without warning when its launcher or its node's daemon is gone; what that process
started would train on unseen, on a core that Ray believes free.
"""

import ctypes
import os
import signal
import sys

SET_PARENT_DEATH_SIGNAL = 1
"""From Linux's `prctl.h`; the setting outlives the `exec` below."""


def main() -> None:
    """Become `hcpg`, on the leash."""
    starter, *arguments = sys.argv[1:]
    if ctypes.CDLL(None).prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGTERM) != 0:
        raise OSError("this kernel sets no signal for a parent's death")
    if os.getppid() == int(starter):  # else it died before the leash was on
        os.execv(sys.executable, [sys.executable, "-m", "hcpg", *arguments])


if __name__ == "__main__":
    main()
