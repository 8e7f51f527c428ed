"""Evaluation episodes as arrays, straight from the bytes of `episodes.jsonl`.

A report may read thousands of these files. Lines exactly as the loops write them are taken apart by one
expression, six times faster than by a JSON parser; any other line goes through the parser, and says the same.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hcpg.report.rows import Row, RowError, complete_lines, decoded
from hcpg.types import Bool, Int

_INTEGER = rb"-?(?:0|[1-9]\d*+)"
_NUMBER = _INTEGER + rb"(?:\.\d++)?+(?:[eE][+-]?\d++)?+"
_TEXT = rb"[ !#-\[\]-~]*+"
"""Of a string without escapes."""
_TRUTH = rb"(?:true|false)"
_WRITTEN = re.compile(
    rb'^\{"step": (' + _INTEGER + rb'), "phase": "(' + _TEXT + rb')", "selector": "(' + _TEXT + rb')", '
    rb'"adapter": "(' + _TEXT + rb')", "environment": ' + _INTEGER + rb', "start": (' + _INTEGER + rb"), "
    rb'"success_once": (' + _TRUTH + rb'), "success_at_end": ' + _TRUTH + rb', "steps_to_success": '
    rb"" + _INTEGER + rb', "return": (?:' + _NUMBER + rb'|null), "length": ' + _INTEGER + rb"\}\n",
    re.MULTILINE,
)
_TYPES = {"selector": str, "adapter": str, "start": int, "success_once": bool}
_EVALUATION = b"evaluation"

Fields = tuple[bytes, bytes, bytes, bytes, bytes, bytes]
"""Step, phase, selector, adapter, start and success of one line, as written."""


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


def read_evaluations(path: Path) -> Evaluations:
    """The evaluation episodes of one `episodes.jsonl` (or its compressed form); none where it is absent.

    A torn last line is dropped with a notice.

    Raises:
        RowError: a line is damaged or lacks a field; the message has the file and the line number.
    """
    content = complete_lines(path)
    found: list[Fields] = _WRITTEN.findall(content)
    if len(found) < content.count(b"\n"):
        found = [_fields(path, number, row) for number, row in enumerate(decoded(path, content), start=1)]
    found = [fields for fields in found if fields[1] == _EVALUATION]
    selectors = list(dict.fromkeys(fields[2] for fields in found))
    return Evaluations(
        frozenset(fields[3].decode() for fields in found),
        {name.decode(): _sorted([each for each in found if each[2] == name]) for name in selectors},
    )


def _sorted(found: Sequence[Fields]) -> Episodes:
    columns = list(zip(*found, strict=True))
    steps, starts = (np.array([int(text) for text in columns[place]], np.int64) for place in (0, 4))
    order = np.lexsort((starts, steps))
    successes = np.array([text == b"true" for text in columns[5]])
    return Episodes(steps[order], starts[order], successes[order])


def _fields(path: Path, number: int, row: Row) -> Fields:
    """What the expression would have found in the line."""
    if row.get("phase") != "evaluation":
        return b"", b"", b"", b"", b"", b""
    for name, kind in _TYPES.items():
        if type(row.get(name)) is not kind:
            raise RowError(
                f"{path}, line {number}: {name!r} is {row.get(name, 'absent')!r}, need {kind.__name__}. "
                "Restore the file, or delete that line."
            )
    success = b"true" if row["success_once"] else b"false"
    step, start = (str(row[name]).encode() for name in ("step", "start"))
    return step, _EVALUATION, row["selector"].encode(), row["adapter"].encode(), start, success
