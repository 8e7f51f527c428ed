"""Evaluation episodes as arrays, straight from the bytes of `episodes.jsonl`.

A report may read thousands of these files. A line as the loops write it is a head (step, phase, selector,
adapter, environment), which recurs from file to file, and a tail (start state, success, and more). One
expression cuts a file into both, and every head is taken apart once only. Any other line goes through a JSON
parser, and says the same.
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
    rb"" + _TEXT + rb', "environment": ' + _INTEGER + rb", "
)
_TAIL = re.compile(
    rb'"start": (' + _INTEGER + rb'), "success_once": (true|false), "success_at_end": (?:true|false), '
    rb'"steps_to_success": ' + _INTEGER + rb', "return": (?:' + _NUMBER + rb'|null), "length": '
    rb"" + _INTEGER + rb'(?:, "value": (?:' + _NUMBER + rb'|null), "discounted_return": (?:' + _NUMBER + rb""
    rb"|null))?+\}\n"
)
_EVALUATION = (
    '{{"step": {step}, "phase": "evaluation", "selector": "{selector}", "adapter": "{adapter}", '
    '"environment": 0, "start": {start}, "success_once": {success_once}, "success_at_end": false, '
    '"steps_to_success": -1, "return": null, "length": 0}}\n'
)
"""What is read of a line, in the form in which the loops write it."""
_TYPES = {"selector": str, "adapter": str, "start": int, "success_once": bool}
_MALFORMED = -1


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
        self.facts = np.zeros((0, 3), np.int64)
        """By head: step, place of its selector and of its adapter; -1 each if it is of training."""

    def __missing__(self, head: bytes) -> int:
        found = _HEAD.fullmatch(head)
        if found is None:
            return _MALFORMED
        step, phase, selector, adapter = found.groups()
        number = self[head] = len(self)
        if number == len(self.facts):
            self.facts = np.concatenate([self.facts, np.full((1 + number, 3), -1)])
        if phase == b"evaluation":
            names = (_place(self.selectors, selector.decode()), _place(self.adapters, adapter.decode()))
            self.facts[number] = (int(step), *names)
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
    cut = _cut(content)
    if _MALFORMED in cut.heads:
        cut = _cut(_rewritten(path, content))
    steps, selectors, adapters = _HEADS.facts[cut.heads].T
    by_selector = {}
    for selector in dict.fromkeys(selectors[selectors >= 0].tolist()):
        own = selectors == selector
        order = np.lexsort((cut.starts[own], steps[own]))
        rows = (column[own][order] for column in (steps, cut.starts, cut.successes))
        by_selector[_HEADS.selectors[selector]] = Episodes(*rows)
    names = frozenset(_HEADS.adapters[place] for place in set(adapters[adapters >= 0].tolist()))
    return Evaluations(names, by_selector)


class _Cut(NamedTuple):
    """Lines taken apart."""

    heads: Int[np.ndarray, " N"]
    """Numbers in `_HEADS`; -1 for a line that is not as the loops write it."""
    starts: Int[np.ndarray, " N"]
    successes: Bool[np.ndarray, " N"]


def _cut(content: bytes) -> _Cut:
    *parts, rest = _TAIL.split(content)
    heads = np.fromiter(map(_HEADS.__getitem__, parts[::3]), np.int64, len(parts) // 3)
    starts = np.array([int(start) for start in parts[1::3]], np.int64)
    successes = np.array([success == b"true" for success in parts[2::3]], bool)
    return _Cut(np.append(heads, _MALFORMED) if rest else heads, starts, successes)


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
    if _MALFORMED in _cut(line.encode()).heads:
        raise RowError(f"{path}, line {number}: {row['selector']!r} or {row['adapter']!r} is no plain name.")
    return line
