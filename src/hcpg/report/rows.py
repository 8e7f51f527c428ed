"""JSON lines: one dict per line, appended while training, read back by reports and resumes.

A process killed while it appends may leave a last line without its line end. That torn line is dropped, by
the reader and by the next append. Any other line that is not JSON means that somebody altered the file.
"""

import gzip
import json
import logging
import math
import os
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hcpg.report.durable import replace_file

Row = dict[str, Any]
_LOG = logging.getLogger(__name__)


class RowError(ValueError):
    """A row that cannot be written, or a line that cannot be read; the message says which."""


def append_rows(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Add one line per row in a single write; NaN and infinities are written as null.

    Raises:
        RowError: a row has no whole number under `step`, or a value that JSON cannot hold.
    """
    payload = _encoded(rows)
    if path.exists():
        _cut_torn_line(path)
    with path.open("ab") as file:
        file.write(payload)


def read_rows(path: Path) -> list[Row]:
    """The file's rows in order, without a torn last line; none where there is no file yet.

    A stored run has its file compressed, with `.gz` added to the name.

    Raises:
        RowError: a complete line is not a JSON object, or a compressed file is damaged; the message has the
            file and the line number.
    """
    return decoded(path, complete_lines(path))


def decoded(path: Path, content: bytes) -> list[Row]:
    """The rows in `content`, the complete lines of `path`.

    Raises:
        RowError: a line is not a JSON object; the message has the file and the line number.
    """
    lines = content.split(b"\n")[:-1]
    return [_decoded(path, number, line) for number, line in enumerate(lines, start=1)]


def last_row(path: Path) -> Row | None:
    """The last complete row alone, None where there is none; the lines before it are not looked at.

    Raises:
        RowError: that line is not a JSON object, or a compressed file is damaged.
    """
    content = complete_lines(path)
    if not content:
        return None
    begin = content.rfind(b"\n", 0, len(content) - 1) + 1
    return _decoded(path, content.count(b"\n"), content[begin:-1])


def complete_lines(path: Path) -> bytes:
    """The file's bytes up to its last line end, with a notice of what is dropped after it.

    Raises:
        RowError: a compressed file is damaged.
    """
    content = _contents(path)
    end = content.rfind(b"\n") + 1
    if end < len(content):
        _LOG.warning("%s: dropped a torn last line (%d bytes)", path, len(content) - end)
    return content[:end]


def _contents(path: Path) -> bytes:
    if path.exists():
        return path.read_bytes()
    packed = path.with_name(path.name + ".gz")
    if not packed.exists():
        return b""
    try:
        return gzip.decompress(packed.read_bytes())
    except (EOFError, OSError, zlib.error) as error:
        raise RowError(f"{packed} is damaged ({error}). Restore it.") from error


def keep_rows_until(path: Path, step: int) -> None:
    """Drop the rows whose `step` is greater than `step`, in one step."""
    kept = [row for row in read_rows(path) if row["step"] <= step]
    replace_file(path, _encoded(kept))


def _encoded(rows: Iterable[Mapping[str, Any]]) -> bytes:
    lines = []
    for row in rows:
        plain = {name: _plain(name, value) for name, value in row.items()}
        if type(plain.get("step")) is not int:
            raise RowError(f"a row needs a whole number under 'step', got {row.get('step')!r} in {plain}")
        lines.append(json.dumps(plain, allow_nan=False) + "\n")
    return "".join(lines).encode()


def _plain(name: str, value: Any) -> Any:
    """A NumPy or JAX scalar as the Python number it holds, and a non-finite one as None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, (bool, int, float, str)) or value is None:
        return value
    raise RowError(f"{name!r} holds {value!r}; a row holds numbers, strings, bools and None only")


def _decoded(path: Path, number: int, line: bytes) -> Row:
    try:
        row = json.loads(line)
    except ValueError as error:
        raise RowError(
            f"{path}, line {number} is not JSON: {line[:80]!r}. Restore the file, or delete that line."
        ) from error
    if not isinstance(row, dict) or type(row.get("step")) is not int:
        raise RowError(f"{path}, line {number} is no row with a 'step': {line[:80]!r}. Delete that line.")
    return row


def _cut_torn_line(path: Path) -> None:
    with path.open("r+b") as file:
        size = file.seek(0, os.SEEK_END)
        if size == 0:
            return
        file.seek(size - 1)
        if file.read(1) == b"\n":
            return
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)
    _LOG.warning("%s: cut a torn last line before appending", path)
