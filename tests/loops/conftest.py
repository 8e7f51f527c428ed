"""One tiny run, trained once for all tests that only look at it."""

import pytest
from tiny_runs import sit, tiny_settings

from hcpg.loops import sitting


@pytest.fixture(scope="session")
def straight(tmp_path_factory):
    """Seed 1 trained alone from beginning to end: the folder and the settings."""
    settings = tiny_settings()
    [folder] = sitting.create_folders(settings, [1], tmp_path_factory.mktemp("straight"))
    sit(settings, [folder])
    return folder, settings
