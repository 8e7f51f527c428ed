"""Logs that a test left open are closed."""

import point_rig
import pytest


@pytest.fixture(autouse=True)
def _closed_logs():
    yield
    while point_rig.OPEN:
        point_rig.OPEN.pop().close()
