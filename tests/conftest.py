"""What all tests share: the folder of real scans, and hypothesis without chance."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("deterministic", derandomize=True, deadline=None)
settings.load_profile("deterministic")


@pytest.fixture(scope="session")
def scans() -> Path:
    """Folder of real scans, which the environment variable VOLPREP_TEST_DATA names. Skips where it names none."""
    folder = os.environ.get("VOLPREP_TEST_DATA", "")
    if not folder:
        pytest.skip("real scans: VOLPREP_TEST_DATA is not set")
    path = Path(folder)
    # A wrong path must not pass for a machine without scans: every test on real input would be skipped unseen.
    assert path.is_dir(), f"VOLPREP_TEST_DATA names {folder}, which is no folder"
    return path
