"""The faults of whole processes: the controller's, killed or frozen; this one, frozen. In real time only."""

import os
import subprocess
from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from hcpg.loops.control.drill import Fault, Site


@runtime_checkable
class Controller(Protocol):
    """The controller's process, as far as a fault can get hold of it."""

    def kill(self) -> None:
        """End it at once, without a word."""
        ...

    def start_in(self, seconds: float) -> None:
        """Start a new one at the same address that much later, without waiting for it."""
        ...

    def freeze(self, seconds: float) -> None:
        """Stop all its threads for so long, without waiting for the end."""
        ...


def process_faults(controller: Controller) -> Mapping[str, Fault]:
    """By name, as `hcpg robot drill --fault` takes it."""

    def kill(site: Site) -> None:
        controller.kill()

    def kill_and_start(site: Site) -> None:
        controller.kill()
        controller.start_in(0.0)

    def freeze(seconds: float) -> Callable[[Site], None]:
        return lambda site: controller.freeze(seconds)

    return {
        "server_killed": Fault("the controller's process is killed", kill),
        "server_restarted": Fault("it is killed, and a new one starts at once", kill_and_start),
        "server_frozen_300_ms": Fault("the controller's process is frozen for 300 ms", freeze(0.3)),
        "server_frozen_5_s": Fault("the controller's process is frozen for 5 s", freeze(5.0)),
        "client_frozen_10_ms": Fault("this process is frozen for 10 ms", _freeze_this(0.01)),
        "client_frozen_100_ms": Fault("this process is frozen for 100 ms", _freeze_this(0.1)),
        "client_frozen_3_s": Fault("this process is frozen for 3 s", _freeze_this(3.0)),
    }


def _freeze_this(seconds: float) -> Callable[[Site], None]:
    """Stop every thread of this process, the 1 kHz loop too, as a hung computer would."""

    def freeze(site: Site) -> None:
        own = os.getpid()
        script = f"kill -STOP {own}; sleep {seconds}; kill -CONT {own}"
        subprocess.run(["sh", "-c", script], check=True)

    return freeze
