"""The last row alone; what is appended, torn and cut is tested beside the run folder, in tests/loops."""

import gzip

import pytest

from hcpg.report.rows import RowError, last_row


def test_the_last_complete_row_is_read_alone(tmp_path):
    path = tmp_path / "metrics.jsonl"
    assert last_row(path) is None
    path.write_text('garbage\n{"step": 1, "wall_s": 2.0}\n{"step": 2, "wa')
    assert last_row(path) == {"step": 1, "wall_s": 2.0}
    path.write_text('{"step": 7}\n')
    assert last_row(path) == {"step": 7}


def test_a_damaged_last_row_is_named_by_its_line(tmp_path):
    path = tmp_path / "metrics.jsonl"
    path.write_text('{"step": 1}\ngarbage\n')
    with pytest.raises(RowError, match=r"metrics\.jsonl, line 2 is not JSON"):
        last_row(path)
    path.unlink()
    (tmp_path / "metrics.jsonl.gz").write_bytes(gzip.compress(b'{"step": 3}\n'))
    assert last_row(path) == {"step": 3}
