"""What a paper's page holds: tables, curves, pictures, and what of the paper's finding holds here."""

import base64
from dataclasses import dataclass, field
from typing import Self

from volprep.truth.picture import encoded
from volprep_formats.arrays import Float32Array
from volprep_formats.png import png_bytes

from .lines import Line


@dataclass(frozen=True)
class Measured:
    """One picture: how long it takes, and how wrong it is."""

    ms: float
    """Milliseconds of a picture."""
    rmse: float | None = None
    """Against the oracle on the scan, premultiplied linear; None where there is no truth to compare with."""
    samples: float | None = None
    """Samples that a pixel takes on the average, where they were counted."""

    @property
    def fps(self) -> float:
        """Pictures in a second."""
        return 1000.0 / self.ms


Cell = Measured | str | float | None
"""A time with its error, a word, a number; None where it was not measured."""


@dataclass(frozen=True)
class PaperTable:
    """A table with the rows and the columns of the paper's."""

    title: str
    """What it is, with its number in the paper."""
    heads: tuple[str, ...]
    """Heads of the columns."""
    rows: tuple[tuple[Cell, ...], ...]
    """Its rows."""
    note: str = ""
    """What differs from the paper's."""


@dataclass(frozen=True)
class PaperCurves:
    """A figure of the paper: curves."""

    title: str
    """What it is, with its number in the paper."""
    x: str
    """What is on the horizontal axis."""
    y: str
    """What is on the vertical axis."""
    lines: tuple[Line, ...]
    """The curves."""
    note: str = ""
    """What differs from the paper's."""


@dataclass(frozen=True)
class PaperPicture:
    """A picture with its caption."""

    caption: str
    """What it shows."""
    png: str
    """PNG in base64."""

    @classmethod
    def of(cls, caption: str, picture: Float32Array) -> Self:
        """Return a rendered picture [H, W, 4] over black."""
        return cls.of_png(caption, png_bytes(encoded(picture, "black")))

    @classmethod
    def of_png(cls, caption: str, png: bytes) -> Self:
        """Return a PNG file."""
        return cls(caption, base64.b64encode(png).decode("ascii"))


@dataclass(frozen=True)
class PaperPictures:
    """A figure of the paper: pictures side by side."""

    title: str
    """What it is, with its number in the paper."""
    pictures: tuple[PaperPicture, ...]
    """The pictures."""
    note: str = ""
    """What differs from the paper's."""


@dataclass(frozen=True)
class Paper:
    """A paper, measured again."""

    name: str
    """Short name, of file and command."""
    title: str
    """Title of the paper."""
    authors: str
    """Authors and year."""
    parts: tuple[PaperTable | PaperCurves | PaperPictures, ...]
    """Tables, curves and pictures, in the order of the paper."""
    finding: str
    """What of the paper's finding holds on this driver, what does not, and why."""
    waiting: tuple[str, ...] = field(default=())
    """What the paper has and this page has not, and why."""
