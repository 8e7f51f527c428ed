"""Trials of policies on an arm, as they were written down: the frozen plan, and what became of every trial.

The folder of one task holds `plan.json`, `ledger.jsonl`, and a folder per attempt with `trial.json` and
`steps.jsonl`. A trial that is invalid is attempted once more; both attempts stay in the ledger.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hcpg.report.records import RecordError
from hcpg.report.rows import complete_lines

PLAN, LEDGER, TRIAL, STEPS = "plan.json", "ledger.jsonl", "trial.json", "steps.jsonl"
KIND = "trials of policies on an arm"
"""Says in a `plan.json` what it is a plan of."""


class Attempt(NamedTuple):
    """One attempt at one trial."""

    number: int
    """Of the trial, from 1, in the order of running."""
    attempt: int
    """1, or 2 where the first was invalid."""
    code: str
    """What the operator was shown instead of the policy's name."""
    policy: str
    start: int
    """The start state; every policy gets the same ones."""
    ended: str
    """`success`, `time_limit`, `fault` or `stopped`; "" where it was begun and its end is not known."""
    cause: str
    invalid: str
    """Why it does not count; "" where it does."""
    detector: bool
    """What the task's own detector said."""
    steps: int
    """Actions until the detector's first hit; -1 if it never came."""
    operator: bool | None
    """What the operator said; None where nobody was asked."""
    referee: bool | None
    """What a simulation's physics said; None on hardware."""
    facts: Mapping[str, Any]
    """Everything else that was written down of it."""

    @property
    def disagreement(self) -> str:
        """Who said what, where the labels are not all alike; "" where they are."""
        said = {"detector": self.detector, "operator": self.operator, "physics": self.referee}
        known = {name: "done" if label else "not done" for name, label in said.items() if label is not None}
        if len(set(known.values())) < 2:
            return ""
        return ", ".join(f"{name}: {label}" for name, label in known.items())


class Study(NamedTuple):
    """The trials of one task."""

    folder: Path
    plan: Mapping[str, Any]
    digest: str
    """SHA-256 of the plan."""
    attempts: tuple[Attempt, ...]
    """In the order of running."""

    @property
    def policies(self) -> tuple[str, ...]:
        """By name, in the plan's order."""
        return tuple(self.plan["policies"])

    def counted(self, policy: str) -> list[Attempt]:
        """The attempts that count, one for each start state at the most."""
        return [each for each in self.attempts if each.policy == policy and not each.invalid]


def digest_of(plan: Mapping[str, Any]) -> str:
    """SHA-256 of the plan's JSON in one form, whatever the order of its keys."""
    text = json.dumps(plan, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def read_study(folder: Path) -> Study:
    """The trials in `folder`.

    Raises:
        RecordError: the plan is not what its hash says, or a line of the ledger is damaged.
    """
    document = json.loads((folder / PLAN).read_text())
    if digest_of(document["plan"]) != document["sha256"]:
        raise RecordError(f"{folder / PLAN} was altered: its plan has another hash. Restore it from a copy.")
    attempts = attempts_of(read_ledger(folder))
    return Study(folder, document["plan"], document["sha256"], tuple(attempts))


def read_ledger(folder: Path) -> list[dict[str, Any]]:
    """The ledger's rows, without a line that a kill left torn.

    Raises:
        RecordError: a complete line is damaged.
    """
    rows = []
    for number, line in enumerate(complete_lines(folder / LEDGER).splitlines(), start=1):
        try:
            rows.append(json.loads(line))
        except ValueError as error:
            raise RecordError(f"{folder / LEDGER}, line {number} is damaged: {line[:80]!r}") from error
    return rows


def attempts_of(rows: Sequence[Mapping[str, Any]]) -> list[Attempt]:
    """What the rows `begun`, `ended` and `judged` of each attempt say together."""
    found: dict[tuple[int, int], dict[str, Any]] = {}
    for row in rows:
        if row["row"] in ("begun", "ended", "judged"):
            known = found.setdefault((row["trial"], row["attempt"]), {})
            said_before = known.get("invalid", "")
            known.update({name: value for name, value in row.items() if name != "row"})
            known["invalid"] = said_before or known.get("invalid", "")
    return [_attempt(facts) for facts in found.values()]


def _with_a_ledger(root: Path) -> Iterator[Path]:
    for folder, inner, files in os.walk(root):
        if "manifest.json" in files:
            inner.clear()  # a run, whose checkpoints and videos hold no trials
        if PLAN in files and LEDGER in files:
            yield Path(folder)


def find_studies(*roots: Path) -> list[Study]:
    """Every task's trials at or under the folders, by task.

    Raises:
        RecordError: one of them is damaged, or two are of one task.
    """
    folders = [folder for root in roots for folder in _with_a_ledger(root)]
    studies = [read_study(folder) for folder in folders if _is_plan(folder / PLAN)]
    names = [study.plan["task"] for study in studies]
    for name in names:
        if names.count(name) > 1:
            twice = ", ".join(str(study.folder) for study in studies if study.plan["task"] == name)
            raise RecordError(f"{name} has trials in {twice}; give one of these folders")
    return sorted(studies, key=lambda study: study.plan["task"])


def _is_plan(path: Path) -> bool:
    return json.loads(path.read_text()).get("kind") == KIND


def _attempt(facts: Mapping[str, Any]) -> Attempt:
    own = ("trial", *Attempt._fields)
    rest = {name: value for name, value in facts.items() if name not in own}
    return Attempt(
        facts["trial"],
        facts["attempt"],
        facts["code"],
        facts["policy"],
        facts["start"],
        facts.get("ended", ""),
        facts.get("cause", ""),
        facts["invalid"] if "ended" in facts else "the end is not known",
        facts.get("detector", False),
        facts.get("steps", -1),
        facts.get("operator"),
        facts.get("referee"),
        rest,
    )
