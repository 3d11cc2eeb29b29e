"""Records of truth.json: the truth pictures beside a report, and the drawings to compare with them on a device.

They lie beside the report and never in the package. A page that measures a device reads them: it needs no camera, no
scan and no rule of its own about levels and steps.
"""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.package.values import PackagePath, Sha256
from volprep_formats.record import Record

TRUTH_FILE = "truth.json"
"""Name of this file, in the folder of truth pictures."""
Matrix = Annotated[tuple[float, ...], Field(min_length=16, max_length=16)]


class TruthView(Record):
    """The truth in one standard view."""

    view: str
    """Name of the standard view."""
    box_from_clip: Matrix
    """From homogeneous clip coordinates to the package's box space, 4×4, row by row."""
    file: PackagePath
    """File of the picture, in the folder of this file: 16 bits a channel, premultiplied linear."""


class TruthPoint(Record):
    """A step at a level, of the sweep."""

    level: Annotated[int, Field(ge=0)]
    """Level to draw."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Distance of the samples."""


class TruthProgram(Record):
    """Drawing with one transfer function."""

    program: str
    """Name of the program that draws it at the finest level."""
    transfer: str
    """Name of the transfer function, or of the picture of several channels."""
    level: Annotated[int, Field(ge=0)]
    """Level of the standard views."""
    views: Annotated[tuple[TruthView, ...], Field(min_length=1)]
    """Standard views, drawn with the nominal step."""
    sweep_view: str
    """The standard view of the sweep."""
    points: tuple[TruthPoint, ...]
    """Steps and levels of the sweep, as validation drew them."""


class TruthIndex(Record):
    """The truth pictures of one validation."""

    format: Literal["volprep-truth"] = "volprep-truth"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor."""
    manifest_sha256: Sha256
    """Digest of the manifest of the package that was validated; the pictures judge no other."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal step of the package."""
    programs: tuple[TruthProgram, ...]
    """Drawings to make."""
