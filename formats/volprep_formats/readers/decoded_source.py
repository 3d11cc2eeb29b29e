"""The base of sources whose slices are decoded in worker processes."""

from contextlib import ExitStack
from typing import Self

from volprep_formats.isolation import Workers, workers
from volprep_formats.source import SourceInfo


class DecodedSource:
    """Keeps workers as long as it is open. Files are not open between slabs."""

    def __init__(self, info: SourceInfo) -> None:
        self._info = info
        self._leave = ExitStack()
        self._workers: Workers = self._leave.enter_context(workers())

    @property
    def info(self) -> SourceInfo:
        """Geometry and type."""
        return self._info

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop the workers if they have no other user."""
        self._leave.close()
