"""Segments of a scan, as the manifest describes them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.program import LAID_OVER, CompositingName
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.package.values import Sha256, Total
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

_NARROWEST, _WIDEST = 256, 2048
"""Labels in a row of the table of looks; every device can hold the wider one."""
LARGEST_SMALL_LABEL = 127
"""Largest label of textures with one byte for each voxel; the eighth bit is a flag."""
LARGEST_LABEL = 2**15 - 1
"""Largest label of textures with two bytes for each voxel."""
OF_ONE_VALUE: frozenset[CompositingName] = frozenset(("maximum", "first-hit"))
"""Compositings that show one value of a ray."""
HIDDEN_BELOW = 1 / 16
"""How far hidden voxels are below the least stored value for them, as part of the range of stored values."""
SAME = 1 / 512
"""Values of a ray that differ by at most this part of the range are one maximum: the labels of the first place count.
Weights of labels there that differ by at most this are equal: the smallest label counts. Rounding would choose one."""
COMPOSITED: frozenset[CompositingName] = OF_ONE_VALUE | LAID_OVER
"""Compositings of programs that draw segments."""
Border = Literal["mixed", "crisp"]
"""How labels meet between voxels."""


class SegmentCode(Record):
    """A coded name."""

    scheme: str
    """Vocabulary, for example SCT."""
    value: str
    """Code in this vocabulary. Modifiers follow after a plus sign."""
    meaning: str
    """Meaning of the code, in words."""


class Segment(Record):
    """One segment."""

    name: ChannelName
    """Unique name that an app uses to switch the segment on and off."""
    title: str | None = None
    """Name for people: the meaning of its code, or a typed name if the scene allows it."""
    code: SegmentCode | None = None
    """Coded name, if there is one."""
    number: Total
    """Number in the source."""
    transfer: str
    """Transfer function that shows it: its style."""
    tint: tuple[Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0)
    """Linear RGB factors of its colours."""
    opacity: Fraction = 1.0
    """Factor of its extinction."""
    visible: bool = True
    """Whether it is shown at first."""
    volume_ml: Annotated[float, Field(ge=0.0)]
    """Volume in millilitres, measured on the source of the segments."""


class SegmentLabel(Record):
    """One label: the segments that its voxels belong to."""

    segments: tuple[ChannelName, ...] = ()
    """Names of segments; several where they overlap, none outside all segments."""
    transfer: str
    """Transfer function that shows it: that of its first segment."""


class Segments(Record):
    """A picture of a scan with its segments.

    Label k is entry k of `labels`. The look of a label, which an app may change, is an entry of the table of looks:
    tint and opacity of its visible segments, hidden if none of them is visible. Of several the tint is the mean, and
    the opacity the largest.
    """

    name: ChannelName = "segments"
    """Name of the picture, which programs name in place of a transfer function."""
    transfers: Annotated[tuple[str, ...], Field(min_length=1)]
    """Transfer functions that show labels, in the order of `labels`, each once."""
    border: Border = "mixed"
    """How labels meet between voxels. mixed: extinction and emission are sums weighted with the trilinear weights of
    the voxels of each label. crisp: the label with the greatest weight."""
    segments: Annotated[tuple[Segment, ...], Field(min_length=1)]
    """All segments, in the order of the source."""
    labels: Annotated[tuple[SegmentLabel, ...], Field(min_length=1, max_length=LARGEST_LABEL + 1)]
    """All labels. Labels of one transfer function are consecutive."""
    outside: Fraction = 1.0
    """Opacity factor of voxels outside all segments."""
    sha256: Sha256
    """Digest of the labels on the grid of the source, 16 bits each, little-endian."""

    @property
    def wide(self) -> bool:
        """Whether labels need two bytes for each voxel."""
        return len(self.labels) - 1 > LARGEST_SMALL_LABEL


def table_shape(labels: int) -> tuple[int, int]:
    """Return rows and columns of the table of looks: one row of a power of two, or several rows of 2048."""
    width = min(_WIDEST, max(_NARROWEST, 1 << (labels - 1).bit_length()))
    return -(-labels // width), width


def looks(segments: Segments) -> tuple[tuple[float, float, float, float], ...]:
    """Return tint and opacity factor of each label, as segments look at first; 0 where a label is hidden."""
    by_name = {segment.name: segment for segment in segments.segments}
    found: list[tuple[float, float, float, float]] = []
    for label in segments.labels:
        if not label.segments:
            found.append((1.0, 1.0, 1.0, segments.outside))
            continue
        shown = [by_name[name] for name in label.segments if by_name[name].visible]
        if not shown:
            found.append((1.0, 1.0, 1.0, 0.0))
            continue
        red, green, blue = (sum(segment.tint[channel] for segment in shown) / len(shown) for channel in range(3))
        found.append((red, green, blue, max(segment.opacity for segment in shown)))
    return tuple(found)
