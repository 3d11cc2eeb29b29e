"""The base of sources whose slices are decoded in worker processes."""

from volprep_formats.isolation import Workers, workers
from volprep_formats.opened_source import OpenedSource
from volprep_formats.source import SourceInfo


class DecodedSource(OpenedSource):
    """Keeps workers as long as it is open. Files are not open between slabs."""

    def __init__(self, info: SourceInfo) -> None:
        super().__init__(info)
        self._workers: Workers = self._opened.enter_context(workers())
