"""Locks that live as long as those who hold them."""

import subprocess
import sys

import pytest
from tiny_cells import cell

from hcpg.experiments.claims import claim_of, is_locked, locked


def test_a_lock_is_had_once_and_seen_by_others(tmp_path):
    path = tmp_path / "new" / "lock"
    assert not is_locked(path)
    file = locked(path)
    assert (locked(path), is_locked(path)) == (None, True)
    file.close()
    assert not is_locked(path)
    locked(path).close()


def test_a_process_that_was_given_the_lock_keeps_it_beyond_its_starter(tmp_path):
    file = locked(tmp_path / "lock")
    waits = [sys.executable, "-c", "input()"]
    heir = subprocess.Popen(waits, stdin=subprocess.PIPE, pass_fds=[file.fileno()])
    other = subprocess.Popen(waits, stdin=subprocess.PIPE)
    file.close()
    assert is_locked(tmp_path / "lock")
    heir.communicate(b"\n")
    assert not is_locked(tmp_path / "lock")
    other.communicate(b"\n")


@pytest.mark.parametrize("other", [cell(1), cell(0, steps=128)])
def test_every_cell_has_a_claim_of_its_own(other, tmp_path):
    assert claim_of(cell(0), tmp_path) == claim_of(cell(0), tmp_path)
    assert claim_of(cell(0), tmp_path) != claim_of(other, tmp_path)
