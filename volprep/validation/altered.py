"""A package in which one text file is another, for diagnostic pictures."""

from volprep_formats.package.reader import Package


class Altered(Package):
    """A package whose other files are its own."""

    def __init__(self, package: Package, altered: str, text: str) -> None:
        """Put `text` in the place of the file `altered`."""
        super().__init__(package.path, package.manifest)
        self._altered = altered
        self._text = text

    def read_text(self, path: str) -> str:
        """Read a text file of the package, or the other text in its place."""
        return self._text if path == self._altered else super().read_text(path)
