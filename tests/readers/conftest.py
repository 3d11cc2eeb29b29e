"""Packages of several kinds in one file, and the three readers, each made once."""

from pathlib import Path

import pytest
from every_kind import write_every_kind
from three_readers import Readers

KINDS = ("house", "bricks", "slices", "several-units", "mipmaps", "together", "segments")
"""Between them they have every part."""


@pytest.fixture(scope="session")
def readers(tmp_path_factory) -> Readers:
    return Readers(tmp_path_factory.mktemp("readers"))


@pytest.fixture(scope="session")
def kinds(tmp_path_factory) -> dict[str, Path]:
    """Packages in one file, by the name of their kind."""
    return write_every_kind(tmp_path_factory.mktemp("kinds"), KINDS)
