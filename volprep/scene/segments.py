"""Settings of a scene for the segments of its scan."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.parts.segments.record import Border
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.record import Record


class SegmentStyle(Record):
    """How some segments look. Of several styles that name a segment the last one counts."""

    labels: tuple[int | str, ...] = ()
    """Segments by their number, name or coded name ("SCT:10200004"); all if absent. Names are compared without case."""
    transfer: str | None = None
    """Transfer function that shows the scan's values inside them; that of `inside` if absent."""
    tint: Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")] | None = None
    """sRGB colour "#rrggbb" that multiplies the function's colours; the colour of the source if absent."""
    opacity: Fraction = 1.0
    """Factor of the function's extinction."""
    visible: bool = True
    """Whether an app shows them at first."""


class SegmentsSettings(Record):
    """A scan with its segments in one picture."""

    source: Annotated[str, Field(min_length=1)]
    """File or folder of the segments: DICOM SEG or RTSTRUCT, .seg.nrrd, a label volume, or a folder with one mask for
    each. A relative path starts at the folder of the scene file."""
    table: str | None = None
    """Names and colours of label numbers, if the source has none: "freesurfer", "slicer", "itksnap", or a file of such
    a program. If absent: FreeSurfer's for files with its names, or a table beside the source. Names of these three are
    public; names of a file are written only with names "free"."""
    names: Literal["coded", "free"] = "coded"
    """Names that the package may hold. "coded": names of public vocabularies, and numbers for other segments. "free":
    also typed names, which may identify a patient."""
    border: Border = "mixed"
    """How segments meet between voxels. "mixed": as their voxels weigh, without steps. "crisp": sharply."""
    smoothing_mm: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Standard deviation of the Gaussian that smooths borders; 0 leaves them. Each voxel gets the label whose filtered
    mask is greatest there; structures thinner than the Gaussian may vanish."""
    inside: str | None = None
    """Transfer function of segments whose style names none; the last one of the scene if absent."""
    outside: str | None = None
    """Transfer function of what belongs to no segment; the first one of the scene if absent."""
    outside_opacity: Fraction = 1.0
    """Factor of the extinction of what belongs to no segment."""
    style: tuple[SegmentStyle, ...] = ()
    """How segments look."""
