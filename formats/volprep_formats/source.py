"""What every reader gives: one volume at full precision, readable slab by slab."""

from typing import Annotated, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from volprep_formats.grid import Count, Grid, Length
from volprep_formats.record import Record

StoredType = Literal["uint8", "int16", "uint16", "float32"]
"""Voxel types that volprep computes with. A reader converts others to the smallest of these that holds them."""
SourceFormat = Literal["auto", "dicom", "metaimage", "nifti", "nrrd", "raw"]


class RawLayout(Record):
    """What a file without a header does not say about itself."""

    shape_zyx: tuple[Count, Count, Count]
    """Number of voxels along z, y and x; x is the fastest axis in the file."""
    dtype: StoredType
    """Type of a voxel in the file."""
    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance between voxel centres, in millimetres."""
    byte_order: Literal["little", "big"] = "little"
    """Byte order of a voxel in the file."""
    header_bytes: Annotated[int, Field(ge=0)] = 0
    """Number of bytes before the first voxel."""


class SourceSpec(Record):
    """Where a scan is and how to read it: the table [source] of a scene."""

    path: str
    """File or folder. A relative path starts at the folder of the scene file."""
    format: SourceFormat = "auto"
    """Reader to use; "auto" looks at the file."""
    series: str | None = None
    """DICOM only: SeriesInstanceUID, or a unique ending of it, when the folder holds several series."""
    raw: RawLayout | None = None
    """Raw only: shape, type, spacing, byte order and header size."""


class SourceInfo(Record):
    """What a source says about itself. Nothing in it can name a patient."""

    format: str
    """Name of the reader: dicom, raw, ..."""
    grid: Grid
    """Positions of the voxels."""
    stored_type: StoredType
    """Type of the values that read_slab gives."""
    slope: float = 1.0
    """physical = slope · stored + intercept."""
    intercept: float = 0.0
    """physical = slope · stored + intercept."""
    unit: str = ""
    """Unit of the physical values, for example HU; empty when the source does not say."""
    modality: str = ""
    """DICOM modality, for example CT or MR; empty when the source does not say."""
    remarks: tuple[str, ...] = ()
    """What the reader noticed and a user should know: repairs, ignored files, missing attributes."""


class VolumeSource(Protocol):
    """An open source. Use it as a context manager."""

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry, known before any voxel is read."""
        ...

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x] in native byte order, of type `info.stored_type`.

        Raises VolprepError when the source is damaged.
        """
        ...

    def __enter__(self) -> Self:
        """Give the source itself."""
        ...

    def __exit__(self, *exception: object) -> None:
        """Close what is open."""
        ...
