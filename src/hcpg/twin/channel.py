"""The served twin's third port: what is true there, and the request to lay out a scene; JSON over UDP."""

import itertools
import json
import queue
import socket
import threading
import time
from typing import Any, NamedTuple

import numpy as np

from hcpg.robot_types import RobotError
from hcpg.twin.bench import Bench, Places
from hcpg.twin.judging import Truth

PORT = 5599
LARGEST = 4096
POLL_S = 1.0 / 60.0
ANSWER_S = 0.1
SEEN_S, KNOWN_S = 0.2, 2.0
"""What was told longer ago than this is not seen, and not known, any more."""
ASKING_S = 2.0
"""A request that the twin does not take up within this time has failed."""


class Request(NamedTuple):
    """Lay out a start state."""

    ticket: int
    start: int


class Teller:
    """The twin's end: answers with what was last said, and keeps requests until the physics takes them."""

    def __init__(self, host: str) -> None:
        """Bind the port at a loopback address and answer in a thread."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((host, PORT))
        self._socket.settimeout(ANSWER_S)
        self._said, self._ends = b"{}", threading.Event()
        self.requests: queue.SimpleQueue[Request] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name="twin-teller", daemon=True)
        self._thread.start()

    def say(self, bench: Bench, ticket: int) -> None:
        """From now on, answer with what is so now; `ticket` is that of the last request taken."""
        facts = {
            "ticket": ticket,
            "waiting": bench.waiting,
            "truth": bench.truth()._asdict(),
            "surveyed": bench.surveyed(),
            "moving": bench.moving(),
        }
        self._said = json.dumps(facts, default=np.ndarray.tolist).encode()

    def close(self) -> None:
        """Stop answering; safe to call twice."""
        self._ends.set()
        self._thread.join()

    def _serve(self) -> None:
        while not self._ends.is_set():
            try:
                message, sender = self._socket.recvfrom(LARGEST)
            except TimeoutError:
                continue
            asked = json.loads(message)
            if asked:
                self.requests.put(Request(**asked))
            self._socket.sendto(self._said, sender)
        self._socket.close()


class Listener:
    """The client's end: knows what was told last, never waits for it. It is a `Stage`."""

    def __init__(self, host: str) -> None:
        self._address, self._tickets = (host, PORT), itertools.count(1)
        self._told: tuple[float, dict[str, Any]] = (-np.inf, {})
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="twin-listener", daemon=True)
        self._thread.start()

    def arrange(self, start: int) -> None:
        """Have start state `start` laid out; where the arm is in the way, that comes later.

        Raises:
            RobotError: the twin does not take the request up.
        """
        ticket = next(self._tickets) + time.monotonic_ns()
        until_s, told = time.monotonic() + ASKING_S, {}
        while time.monotonic() < until_s:
            self._ask(Request(ticket, start)._asdict())
            time.sleep(2 * POLL_S)
            told = self._facts(KNOWN_S)
            if told.get("ticket") == ticket and not told["waiting"]:
                return
        if told.get("ticket") != ticket:
            cure = "is it running? See `make twin`"
            raise RobotError(f"the twin at {self._address[0]} lays out nothing; {cure}")

    def truth(self) -> Truth:
        """What is true there.

        Raises:
            RobotError: nothing was told of late.
        """
        facts = self._facts(KNOWN_S)
        if not facts:
            raise RobotError(f"the twin at {self._address[0]} tells nothing; is it running? See `make twin`")
        told = {name: _array(value) for name, value in facts["truth"].items()}
        return Truth(**told)

    def surveyed(self) -> Places:
        """Where the thing that does not move was touched off, m, by its name."""
        return {name: np.array(place) for name, place in self._facts(np.inf).get("surveyed", {}).items()}

    def moving(self) -> Places:
        """Where the thing that a camera follows is now, m, by its name; empty where nothing is told."""
        return {name: np.array(place) for name, place in self._facts(SEEN_S).get("moving", {}).items()}

    def close(self) -> None:
        """Stop asking; safe to call twice."""
        self._ends.set()
        self._thread.join()

    def _facts(self, age_s: float) -> dict[str, Any]:
        told_s, facts = self._told
        return facts if time.monotonic() - told_s < age_s else {}

    def _follow(self) -> None:
        while not self._ends.wait(POLL_S):
            self._ask({})

    def _ask(self, request: dict[str, Any]) -> None:
        """Send a request and keep the answer; no answer in time is none, and what was told grows old."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
            asking.settimeout(ANSWER_S)
            asking.connect(self._address)
            try:
                asking.send(json.dumps(request).encode())
                self._told = (time.monotonic(), json.loads(asking.recv(LARGEST)))
            except (TimeoutError, ConnectionRefusedError):
                return


def _array(value: Any) -> Any:
    return np.array(value) if isinstance(value, list) else value
