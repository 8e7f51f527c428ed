"""What has been tried, on the disk before anything goes on: no trial is dropped, none is run twice."""

import fcntl
import json
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.loops.control.step_log import plain
from hcpg.loops.trials.plan import Plan, Slot, slots
from hcpg.report.checkout import commit_text, own_code
from hcpg.report.dotted import dotted
from hcpg.report.durable import replace_file, replace_json, sync_folder
from hcpg.report.rows import complete_lines
from hcpg.report.trial_records import KIND, LEDGER, PLAN, TRIAL, Attempt, attempts_of, digest_of, read_ledger

ATTEMPTS = 2
"""A trial that is invalid is repeated once."""
CUT_OFF = "the program ended in the middle of it"


class LedgerError(RuntimeError):
    """A folder that belongs to other trials, or that somebody else runs; the message says what to do."""


class Turn(NamedTuple):
    """What comes next."""

    slot: Slot
    attempt: int

    @property
    def folder(self) -> str:
        """Name of the attempt's own folder; it does not tell who acts."""
        again = "" if self.attempt == 1 else f"_again{self.attempt}"
        return f"trial_{self.slot.number:03d}_{self.slot.code}{again}"


class Ledger:
    """The folder of one task's trials; use it as a block, which no second process can enter."""

    def __init__(self, folder: Path, plan: Plan) -> None:
        """Begin in a new folder, or go on in one that was begun under the same plan.

        Raises:
            LedgerError: the plan is another one; the message lists what differs.
        """
        self.folder, self._slots, self._plan = folder, slots(plan), plan
        self.commit = commit_text(own_code())
        folder.mkdir(parents=True, exist_ok=True)
        document = {"kind": KIND, "plan": plan.as_json(), "sha256": digest_of(plan.as_json())}
        if (folder / PLAN).exists():
            self._refuse_another(document)
        else:
            replace_json(folder / PLAN, document)
        self.digest = document["sha256"]

    def __enter__(self) -> "Ledger":
        self._lock = (self.folder / "lock").open("a+")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._lock.close()
            raise LedgerError(f"another process runs the trials in {self.folder}; wait for it") from error
        self._close_cut_off()
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    @property
    def attempts(self) -> list[Attempt]:
        """All attempts so far."""
        return attempts_of(read_ledger(self.folder))

    @property
    def size(self) -> int:
        """How many trials there are."""
        return len(self._slots)

    def next(self) -> Turn | None:
        """The first trial that is not done; None once all are."""
        made: dict[int, list[Attempt]] = {}
        for each in self.attempts:
            made.setdefault(each.number, []).append(each)
        for slot in self._slots:
            before = made.get(slot.number, [])
            if len(before) < ATTEMPTS and all(each.invalid for each in before):
                return Turn(slot, len(before) + 1)
        return None

    def unjudged(self) -> list[Turn]:
        """Attempts that ended and that an operator was to judge, but did not."""
        judged = {
            (row["trial"], row["attempt"]) for row in read_ledger(self.folder) if row["row"] == "judged"
        }
        open_ones = [
            each
            for each in self.attempts
            if not each.invalid and each.facts.get("to_judge") and each[:2] not in judged
        ]
        return [Turn(self._slots[each.number - 1], each.attempt) for each in open_ones]

    def begin(self, turn: Turn) -> Path:
        """Write down that the arm is about to move; gives the attempt's own folder."""
        path = self.folder / turn.folder
        path.mkdir(exist_ok=True)  # a kill between this line and the row below leaves an empty folder
        facts = {**self._name(turn), "task": self._plan.task, "kind": self._plan.kind, "plan": self.digest}
        replace_json(path / TRIAL, {**facts, "served": self._plan.served, "horizon": self._plan.horizon})
        self._append({"row": "begun", **self._name(turn), "commit": self.commit})
        return path

    def end(self, turn: Turn, facts: Mapping[str, Any]) -> None:
        """Write down how it went."""
        self._append({"row": "ended", "trial": turn.slot.number, "attempt": turn.attempt, **facts})

    def judge(self, turn: Turn, operator: bool | None, invalid: str) -> None:
        """Write down what the operator said."""
        said = {"operator": operator, "invalid": invalid}
        self._append({"row": "judged", "trial": turn.slot.number, "attempt": turn.attempt, **said})

    def note(self, what: str) -> None:
        """Write down an event that belongs to no attempt."""
        self._append({"row": "event", "what": what})

    def _name(self, turn: Turn) -> dict[str, Any]:
        slot = turn.slot
        own = {"trial": slot.number, "attempt": turn.attempt, "code": slot.code}
        return {**own, "policy": slot.policy, "start": slot.start}

    def _close_cut_off(self) -> None:
        """An attempt that has no end does not count: nobody saw what came of it."""
        for each in self.attempts:
            if not each.ended:
                turn = Turn(self._slots[each.number - 1], each.attempt)
                self.end(turn, {"ended": "stopped", "cause": CUT_OFF, "invalid": CUT_OFF})

    def _append(self, row: Mapping[str, Any]) -> None:
        """One line, on the disk when this returns; a torn last line goes first."""
        path = self.folder / LEDGER
        if path.exists() and path.stat().st_size > len(whole := complete_lines(path)):
            replace_file(path, whole)
        line = json.dumps(plain({**row, "time": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"}), allow_nan=False)
        with path.open("ab") as file:
            file.write(line.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        sync_folder(self.folder)

    def _refuse_another(self, document: Mapping[str, Any]) -> None:
        there = json.loads((self.folder / PLAN).read_text())
        if there.get("sha256") == document["sha256"] == digest_of(there["plan"]):
            return
        before, asked = dotted(there.get("plan", {})), dotted(document["plan"])
        lines = [
            f"  {key}: {before.get(key, 'absent')} in the plan, {asked.get(key, 'absent')} asked for"
            for key in sorted(before.keys() | asked.keys())
            if before.get(key) != asked.get(key)
        ]
        raise LedgerError(
            f"the trials in {self.folder} were begun under another plan (hash {there.get('sha256')}, now "
            f"{document['sha256']}):\n"
            + "\n".join(lines)
            + "\nGo on with the plan's values, or give a new folder."
        )
