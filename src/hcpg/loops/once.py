"""Programs kept for the life of a process: a second run of the same settings compiles nothing."""

from collections.abc import Callable
from functools import lru_cache
from typing import ParamSpec, TypeVar, cast

Given = ParamSpec("Given")
Made = TypeVar("Made")
MOST = 32
"""Programs of one kind that are kept; the one longest unused goes first."""


def once(make: Callable[Given, Made]) -> Callable[Given, Made]:
    """`make`, but for arguments that it was called with before: then what it made at that time.

    For functions that make a jitted function: made anew it would be traced and compiled anew. All arguments
    must be hashable, which settings, methods and selectors are.
    """
    return cast("Callable[Given, Made]", lru_cache(MOST)(make))
