"""Files that a crash leaves either as they were or as they shall be, never in between."""

import hashlib
import json
import os
from pathlib import Path
from typing import Any


def replace_file(path: Path, content: bytes) -> None:
    """Put `content` at `path`: written beside it, flushed to the disk, then renamed over it."""
    beside = path.with_name(f".{path.name}.writing")
    with beside.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    beside.rename(path)
    sync_folder(path.parent)


def replace_json(path: Path, value: Any) -> None:
    """Put `value` at `path` as indented JSON, in one step.

    Raises:
        ValueError: a number is not finite (JSON has no word for it).
        TypeError: a value is none of dict, list, tuple, string, number, bool and None.
    """
    text = json.dumps(value, indent=2, allow_nan=False)
    replace_file(path, text.encode() + b"\n")


def json_digest(value: Any) -> str:
    """The SHA-256 of a value that JSON can hold, the same for what is read back of it.

    Raises:
        ValueError: a number is not finite.
    """
    plain = json.loads(json.dumps(value, allow_nan=False))  # tuples and number keys as they will come back
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def sync_file(path: Path) -> None:
    """Wait until the file's bytes are on the disk."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sync_folder(path: Path) -> None:
    """Wait until the folder's entries (creations, renames) are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
