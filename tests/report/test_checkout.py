"""The code's commit, as git itself tells it."""

import hashlib
import subprocess

import pytest

from hcpg.report.checkout import code, commit_text


def git(folder, *arguments):
    identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
    command = ["git", "-C", folder, *identity, *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def checkout(tmp_path):
    (tmp_path / "requirements").mkdir()
    (tmp_path / "requirements" / "run.txt").write_text("numpy==2.0\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "one")
    return tmp_path


def test_code_names_commit_changes_and_locks(checkout):
    lock = {"run.txt": hashlib.sha256(b"numpy==2.0\n").hexdigest()}
    commit = git(checkout, "rev-parse", "HEAD")
    assert code(checkout) == {"commit": commit, "dirty": False, "locks": lock}
    (checkout / "new.py").write_text("")
    assert code(checkout) == {"commit": commit, "dirty": True, "locks": lock}


def test_code_outside_a_checkout_has_no_commit(checkout):
    inside = checkout / "site-packages"
    inside.mkdir()
    assert code(inside) == {"commit": None, "dirty": None, "locks": {}}


def test_the_short_text_marks_changes():
    assert commit_text({"commit": "0123456789", "dirty": False}) == "0123456"
    assert commit_text({"commit": "0123456789", "dirty": True}) == "0123456+"
    assert (commit_text({"commit": None}), commit_text({})) == ("unknown", "unknown")
