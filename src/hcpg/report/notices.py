"""What reading the runs had to say, on the terminal and kept for the page: lines dropped, runs left out."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager


class _Keeping(logging.Handler):
    def __init__(self) -> None:
        super().__init__()
        self.notices: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.notices.append(record.getMessage())


@contextmanager
def noticed() -> Iterator[list[str]]:
    """The notices given inside the block, as they come; each goes to the standard error, too."""
    with _handled(logging.StreamHandler()), kept() as notices:
        yield notices


@contextmanager
def kept() -> Iterator[list[str]]:
    """The notices given inside the block, as they come, for another process to give."""
    keeping = _Keeping()
    with _handled(keeping):
        yield keeping.notices


@contextmanager
def _handled(handler: logging.Handler) -> Iterator[None]:
    log = logging.getLogger("hcpg.report")
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
