"""Small previews: a build of a test and each validation draw one, which takes 0.2 s of processor time at full size."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from volprep.pipeline import preview

FULL = preview._SIZE
"""Pixels along a side of the previews that volprep draws."""


@contextmanager
def small_previews(size: int = 64) -> Iterator[None]:
    """Draw previews of `size` pixels along a side."""
    with patch.object(preview, "_SIZE", size):
        yield
