"""`hcpg doctor`: what this machine offers, each failure with its cure."""

import argparse
import sys
from collections.abc import Sequence

from hcpg.loops.doctor import Finding, examine

_MARKS = {True: "ok", "warning": "warning", False: "MISSING"}


def run(arguments: Sequence[str]) -> int:
    """Print the findings; 1 if something that training needs is missing."""
    description = "Look at this machine: what works, what is missing, and the cure."
    argparse.ArgumentParser(prog="hcpg doctor", description=description).parse_args(arguments)
    findings = examine()
    width = max(len(finding.name) for finding in findings)
    sys.stdout.writelines(_line(finding, width) for finding in findings)
    return int(any(finding.ok is False for finding in findings))


def _line(finding: Finding, width: int) -> str:
    line = f"{_MARKS[finding.ok]:8} {finding.name:{width}}  {finding.value}\n"
    return f"{line}{'':8} {'':{width}}  cure: {finding.cure}\n" if finding.cure else line
