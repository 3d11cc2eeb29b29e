"""The base of open sources: facts from the header, and resources that are closed with the source."""

from contextlib import AbstractContextManager, ExitStack
from typing import Self

from volprep_formats.source import SourceInfo


class OpenedSource:
    """Facts, and resources that were entered before."""

    def __init__(self, info: SourceInfo, *resources: AbstractContextManager[object]) -> None:
        self._info = info
        self._opened = ExitStack()
        for resource in resources:
            self._opened.push(resource)

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry."""
        return self._info

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Close the resources."""
        self._opened.close()
