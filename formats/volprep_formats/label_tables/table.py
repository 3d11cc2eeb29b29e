"""Table of labels: the number, name and colour of each thing in a label map."""

import colorsys
from dataclasses import dataclass
from functools import cached_property

LABEL_TABLES = ("freesurfer", "itksnap", "slicer")
"""Tables that come with volprep."""
_GOLDEN = (5**0.5 - 1) / 2
"""Golden angle, as a fraction of a turn: its multiples stay apart however many there are."""
_LIGHTNESS_SATURATION = ((0.62, 0.65), (0.45, 0.6), (0.75, 0.55), (0.55, 0.35))


@dataclass(frozen=True)
class LabelEntry:
    """One label."""

    number: int
    """Value of its voxels."""
    name: str
    """Name of the thing; "" if the table has none."""
    colour: str
    """sRGB colour "#rrggbb"."""
    opacity: float = 1.0
    """0 for a label that the table hides, else the table's opacity or 1."""


@dataclass(frozen=True)
class LabelTable:
    """Names and colours of the labels of one map, by ascending number."""

    name: str
    """Name for messages: that of a built-in table, or of a file."""
    entries: tuple[LabelEntry, ...]
    """One entry for each number; 0, the background, has none."""

    @cached_property
    def by_number(self) -> dict[int, LabelEntry]:
        """Return the entries by their number."""
        return {entry.number: entry for entry in self.entries}

    def entry(self, number: int) -> LabelEntry:
        """Return the entry of a number; one without a name and with a made colour if the table lacks it."""
        return self.by_number.get(number) or LabelEntry(number, "", made_colour(number))


def made_colour(number: int) -> str:
    """Return a colour for a label without one: hues by the golden angle, in four kinds of light and dark."""
    lightness, saturation = _LIGHTNESS_SATURATION[number % 4]
    shares = colorsys.hls_to_rgb(number * _GOLDEN % 1.0, lightness, saturation)
    return "#" + "".join(f"{round(255 * share):02x}" for share in shares)
