"""Trackers of a training: one `hcpg track` beside it, which follows the run folders and shares no more."""

import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from hcpg.loops.child import Message
from hcpg.loops.population import Lane, View

PATIENCE_S = 60.0
"""How long trackers may take to write out or send what is left once all runs have ended."""


class TrackedView:
    """A view that also starts the trackers, once every run has a folder and trains, or has ended."""

    def __init__(self, view: View, lanes: Iterable[Lane], trackers: Sequence[str]) -> None:
        """`trackers` are names out of `TRACKERS`; with none, this is the view alone."""
        self._view, self._trackers = view, list(trackers)
        self._waited = set(lanes)
        self._folders: list[Path] = []
        self._process: subprocess.Popen[bytes] | None = None

    def tell(self, lane: Lane, message: Message) -> None:
        """News of one run."""
        self._view.tell(lane, message)
        if message.kind == "opened":
            self._folders.append(Path(message.facts["folder"]))
            return
        # A run that reports has its folder locked and its rows taken back to its checkpoint.
        self._waited.discard(lane)
        if not self._waited and self._trackers and self._folders and self._process is None:
            self._process = self._started()

    def say(self, text: str) -> None:
        """A word about the whole command."""
        self._view.say(text)

    def beat(self) -> None:
        """Time has passed."""
        self._view.beat()

    def finish(self) -> str:
        """Wait for the trackers; gives what went wrong with them, nothing if all is well."""
        if self._process is None:
            return ""
        try:
            code = self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return f"the trackers took longer than {PATIENCE_S:.0f} s to end; run again: {self._again()}"
        return f"the trackers failed, see {self._log}; run again: {self._again()}" if code else ""

    @property
    def _log(self) -> Path:
        return self._folders[0] / "tracker.txt"

    def _arguments(self) -> list[str]:
        return ["track", *map(str, self._folders), "--tracker", *self._trackers]

    def _again(self) -> str:
        return " ".join(["hcpg", *self._arguments()])

    def _started(self) -> "subprocess.Popen[bytes]":
        """In a session of its own: Ctrl-C is for the training, and the trackers end with it."""
        command = [sys.executable, "-m", "hcpg", *self._arguments(), "--follow"]
        with self._log.open("ab") as log:
            return subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
