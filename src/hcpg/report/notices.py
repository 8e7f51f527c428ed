"""What reading the runs had to say, on the terminal and kept for the page: lines dropped, runs left out."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager


class _Keeping(logging.StreamHandler):
    def __init__(self) -> None:
        super().__init__()
        self.kept: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.kept.append(record.getMessage())
        super().emit(record)


@contextmanager
def noticed() -> Iterator[list[str]]:
    """The notices given inside the block, as they come; each goes to the standard error, too."""
    keeping, log = _Keeping(), logging.getLogger("hcpg.report")
    log.addHandler(keeping)
    try:
        yield keeping.kept
    finally:
        log.removeHandler(keeping)
