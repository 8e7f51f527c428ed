"""Which code this is: the commit of a checkout, whether it was altered, and its lock files."""

import hashlib
import shutil
import subprocess
from pathlib import Path
from typing import Any

import hcpg


def code(root: Path) -> dict[str, Any]:
    """The commit of the checkout at `root`, whether it was altered, and the SHA-256 of each lock file.

    The commit is None where the package was installed from a wheel, or without git.
    """
    files = sorted((root / "requirements").glob("*.txt"))
    locks = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    checkout = (root / ".git").exists() and shutil.which("git") is not None
    commit = _git(root, "rev-parse", "HEAD") if checkout else None
    altered = _git(root, "status", "--porcelain") if checkout else None
    return {"commit": commit, "dirty": None if altered is None else altered != "", "locks": locks}


def own_code() -> dict[str, Any]:
    """The same of the checkout that this package was imported from."""
    return code(Path(hcpg.__file__).resolve().parents[2])


def commit_text(found: dict[str, Any]) -> str:
    """What `code` found, short: `1a2b3c4`, with a plus where the checkout was altered."""
    if not found.get("commit"):
        return "unknown"
    return found["commit"][:7] + ("+" if found.get("dirty") else "")


def _git(root: Path, *arguments: str) -> str | None:
    """What git answers, or None where it refuses (a checkout of another user, say)."""
    done = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else None
