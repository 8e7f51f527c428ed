"""Evaluation episodes as arrays, straight from the bytes of `episodes.jsonl`.

A report may read thousands of these files. A line as the loops write it is a head, which says what was
evaluated and recurs from file to file, and a tail, which says how it went. One expression cuts the file into
both, and every head is taken apart once only. Any other line goes through a JSON parser, and says the same.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg.report.rows import Row, RowError, complete_lines, decoded
from hcpg.types import Bool, Int

_INTEGER = rb"-?(?:0|[1-9]\d*+)"
_NUMBER = _INTEGER + rb"(?:\.\d++)?+(?:[eE][+-]?\d++)?+"
_TEXT = rb'"([ !#-\[\]-~]*+)"'
"""A string without escapes."""
_HEAD = re.compile(
    rb'\{"step": (' + _INTEGER + rb'), "phase": ' + _TEXT + rb', "selector": ' + _TEXT + rb', "adapter": '
    rb"" + _TEXT + rb', "environment": ' + _INTEGER + rb', "start": (' + _INTEGER + rb"), "
)
_TAIL = re.compile(
    rb'"success_once": (true|false), "success_at_end": (?:true|false), "steps_to_success": '
    rb"" + _INTEGER + rb', "return": (?:' + _NUMBER + rb'|null), "length": ' + _INTEGER + rb"\}\n"
)
_EVALUATION = (
    '{{"step": {step}, "phase": "evaluation", "selector": "{selector}", "adapter": "{adapter}", '
    '"environment": 0, "start": {start}, "success_once": {success_once}, "success_at_end": false, '
    '"steps_to_success": -1, "return": null, "length": 0}}\n'
)
"""What is read of a line, in the form in which the loops write it."""
_TYPES = {"selector": str, "adapter": str, "start": int, "success_once": bool}
_OF_TRAINING = -1
_MALFORMED = -2


class Episodes(NamedTuple):
    """Evaluation episodes with one selector, by step of training, then by start state."""

    steps: Int[np.ndarray, " N"]
    starts: Int[np.ndarray, " N"]
    successes: Bool[np.ndarray, " N"]
    """`success_once`."""


class Evaluations(NamedTuple):
    """All evaluation episodes of one run."""

    adapters: frozenset[str]
    by_selector: dict[str, Episodes]
    """In the order in which the selectors appear."""


class _Heads(dict[bytes, int]):
    """Numbers every head of an evaluation's line when it is first looked up."""

    def __init__(self) -> None:
        super().__init__()
        self.selectors: list[str] = []
        self.adapters: list[str] = []
        self.numbers = np.zeros((0, 4), np.int64)
        """By head: step, start, place of its selector and of its adapter."""

    def __missing__(self, head: bytes) -> int:
        found = _HEAD.fullmatch(head)
        if found is None:
            return _MALFORMED
        step, phase, selector, adapter, start = found.groups()
        if phase != b"evaluation":
            return _OF_TRAINING  # its start state was drawn, so it hardly recurs
        number = self[head] = len(self)
        if number == len(self.numbers):
            self.numbers = np.concatenate([self.numbers, np.zeros((1 + number, 4), np.int64)])
        names = (_place(self.selectors, selector.decode()), _place(self.adapters, adapter.decode()))
        self.numbers[number] = (int(step), int(start), *names)
        return number


def _place(names: list[str], name: str) -> int:
    """Where `name` stands among `names`, which it joins if it is new."""
    if name not in names:
        names.append(name)
    return names.index(name)


_HEADS = _Heads()


def read_evaluations(path: Path) -> Evaluations:
    """The evaluation episodes of one `episodes.jsonl` (or its compressed form); none where it is absent.

    A torn last line is dropped with a notice.

    Raises:
        RowError: a line is damaged or lacks a field; the message has the file and the line number.
    """
    content = complete_lines(path)
    numbers, successes = _cut(content)
    if _MALFORMED in numbers:
        numbers, successes = _cut(_rewritten(path, content))
    chosen = numbers >= 0
    facts, successes = _HEADS.numbers[numbers[chosen]], successes[chosen]
    by_selector = {}
    for selector in dict.fromkeys(facts[:, 2].tolist()):
        own = facts[:, 2] == selector
        steps, starts = facts[own, 0], facts[own, 1]
        order = np.lexsort((starts, steps))
        by_selector[_HEADS.selectors[selector]] = Episodes(steps[order], starts[order], successes[own][order])
    adapters = frozenset(_HEADS.adapters[place] for place in set(facts[:, 3].tolist()))
    return Evaluations(adapters, by_selector)


def _cut(content: bytes) -> tuple[Int[np.ndarray, " N"], Bool[np.ndarray, " N"]]:
    """Of every line the number of its head, and whether it was a success."""
    *parts, rest = _TAIL.split(content)
    heads = [*parts[::2], rest] if rest else parts[::2]
    numbers = np.fromiter(map(_HEADS.__getitem__, heads), np.int64, len(heads))
    return numbers, np.array([each == b"true" for each in parts[1::2]] + [False] * bool(rest), bool)


def _rewritten(path: Path, content: bytes) -> bytes:
    """The evaluations' lines of `content` in the form in which the loops write them."""
    rows = decoded(path, content)
    lines = (_line(path, number, row) for number, row in enumerate(rows, start=1) if _evaluates(row))
    return "".join(lines).encode()


def _evaluates(row: Row) -> bool:
    return row.get("phase") == "evaluation"


def _line(path: Path, number: int, row: Row) -> str:
    for name, kind in _TYPES.items():
        if type(row.get(name)) is not kind:
            raise RowError(
                f"{path}, line {number}: {name!r} is {row.get(name, 'absent')!r}, need {kind.__name__}. "
                "Restore the file, or delete that line."
            )
    line = _EVALUATION.format(**{**row, "success_once": str(row["success_once"]).lower()})
    if _MALFORMED in _cut(line.encode())[0]:
        raise RowError(f"{path}, line {number}: {row['selector']!r} or {row['adapter']!r} is no plain name.")
    return line
