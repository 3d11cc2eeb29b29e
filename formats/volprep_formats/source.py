"""What every reader gives: one volume at full precision, readable slab by slab."""

from pathlib import Path
from typing import Annotated, Literal, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, model_validator

from volprep_formats.grid import LONGEST_AXIS, Count, Grid, Length
from volprep_formats.path_text import path_of_text, path_text
from volprep_formats.record import Record

StoredType = Literal["uint8", "int16", "uint16", "float32"]
"""Voxel types that volprep computes with. A reader converts others to the smallest of these that holds them."""
SourceFormat = Literal[
    "analyze",
    "auto",
    "dicom",
    "metaimage",
    "mgh",
    "mosaic",
    "nifti",
    "npy",
    "nrrd",
    "ome-tiff",
    "ome-zarr",
    "raw",
    "stack",
    "vdb",
    "volpkg",
    "vti",
    "vtk",
]


ChannelName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=60)]
"""Name of a channel, which becomes part of names of files."""
RepairKind = Literal["gaps", "tilt"]
"""What can be repaired where slices form no grid."""
GreyOf = Literal["luminance", "red", "green", "blue"]
"""What of three colours becomes the one value of a voxel."""


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
    header_bytes: Annotated[int, Field(ge=0, le=2**53)] = 0
    """Number of bytes before the first voxel."""


class StackLayout(Record):
    """What pictures do not say about the volume whose slices they are."""

    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance from picture to picture, from row to row and from column to column, in millimetres."""
    gaps: Literal["refuse", "ignore"] = "refuse"
    """What to do if numbers are missing in the names of the pictures. "ignore" takes the pictures that exist as
    neighbours, all at the same distance."""


class ArrayLayout(Record):
    """What a NumPy file does not say: its array has axes z, y and x, and no spacing."""

    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance between voxel centres, in millimetres."""
    name: str | None = None
    """Name of the array, where a .npz file holds several."""


class TileLayout(Record):
    """How the slices of a volume lie in one picture: row by row, from the top left."""

    tiles_x: Count
    """Number of tiles beside each other."""
    tiles_y: Count
    """Number of tiles above each other."""
    slices: Count
    """Number of tiles that are slices; the tiles after them may hold anything."""
    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance from slice to slice, from row to row and from column to column, in millimetres."""


class SourceSpec(Record):
    """Where a scan is and how to read it: the table [source] of a scene."""

    path: str = ""
    """File or folder. A relative path starts at the folder of the scene file. A path of bytes that are no UTF-8 is a
    file URI, file:///scans/%FF.nii."""
    channels: "Literal['all'] | tuple[ChannelSpec, ...]" = ()
    """Several channels of one volume. "all": all that the file has (OME, packages, the volumes of a NIfTI file), under
    their own names if it has names. Or a list of registered files, each with its own path and settings. If absent, the
    source is one channel."""
    format: SourceFormat = "auto"
    """Reader to use; "auto" looks at the file."""
    labels: bool = False
    """Whether voxels are labels: whole numbers that name things. They are never rounded or averaged. Numbers above 255
    are replaced by codes from 0 to 255, in ascending order, over which transfer functions then are."""
    series: str | None = None
    """DICOM: SeriesInstanceUID, or a unique ending of it, when the folder holds several series. OME: name of the image,
    or its number from 1, when there are several."""
    volume: Count | None = None
    """DICOM, NIfTI, FreeSurfer, Analyze, OME: which volume to read, from 1, where there are several: time points,
    echoes, components."""
    channel: str | Count | None = None
    """OME, packages: name of the channel, or its number from 1, when there are several."""
    level: Annotated[int, Field(ge=0, le=LONGEST_AXIS)] | None = None
    """OME-Zarr, packages: which resolution to read; if absent, the finest one."""
    missing: Literal["fill"] | None = None
    """OME-Zarr only: what chunks are that are not there. Writers leave out those that hold nothing but the fill value,
    but a copy that broke off lacks them, too: where more than a quarter is missing the store is refused. "fill" takes
    all of them for the fill value."""
    repair: tuple[RepairKind, ...] = ()
    """DICOM only: what may be repaired by interpolation if slices do not form a grid. "gaps": missing slices and uneven
    distances. "tilt": a tilted gantry. If absent, such a series is refused."""
    rgb: GreyOf | None = None
    """DICOM, stacks of pictures, mosaics: what to do with colours. "luminance" makes them grey, 0.299 red + 0.587 green
    + 0.114 blue; "red", "green" and "blue" take one of them. If absent, pictures in colour are refused."""
    grid: str | None = None
    """OpenVDB only: name of the grid, when the file holds several."""
    mask: str | None = None
    """File of a mask with the same voxels; a relative path starts at the folder of the scene file. Where it is 0, the
    scan gets the value `outside` before anything is made of it: no level, normal, table, mesh or preview knows what was
    there."""
    outside: FiniteFloat | None = None
    """Physical value of what a mask leaves out. If absent, the least value of the scan, for which it is read twice."""
    nan: Literal["outside"] | FiniteFloat | None = None
    """What voxels become that are not a number: a physical value, or "outside" for the value of that key. If absent,
    they are refused."""
    raw: RawLayout | None = None
    """Raw only: shape, type, spacing, byte order and header size."""
    stack: StackLayout | None = None
    """Stack of pictures only: spacing, and whether numbers may be missing."""
    array: ArrayLayout | None = None
    """NumPy only: spacing, and the name of the array."""
    mosaic: TileLayout | None = None
    """Mosaic only: how many tiles the picture has, how many of them are slices, and the spacing."""

    def place(self, base: Path) -> Path:
        """Return the path of the file or folder; a relative one starts at `base`."""
        return base / path_of_text(self.path)

    def mask_place(self, base: Path) -> Path | None:
        """Return the path of the mask, if there is one; a relative one starts at `base`."""
        return None if self.mask is None else base / path_of_text(self.mask)

    def places(self) -> tuple[Path, ...]:
        """Return the paths of all that is read, which are absolute in a resolved scene."""
        mask = self.mask_place(Path())
        return (self.place(Path()),) if mask is None else (self.place(Path()), mask)

    def resolved(self, base: Path, instead: Path | None = None) -> Self:
        """Return the same source with absolute paths: they start at `base`, and `instead` replaces that of the scan."""
        mask = self.mask_place(base)
        where = instead.absolute() if instead is not None else self.place(base)
        return self.model_copy(update={"path": path_text(where), "mask": None if mask is None else path_text(mask)})

    def without_place(self) -> Self:
        """Return the same source without what says where it is, or which of several: names that are not ours."""
        if isinstance(self.channels, tuple) and self.channels:
            return self.model_copy(update={"channels": tuple(each.without_place() for each in self.channels)})
        mask = None if self.mask is None else "mask"
        return self.model_copy(update={"path": "imported", "mask": mask, "series": None, "channel": None, "grid": None})

    @model_validator(mode="after")
    def _is_one_place_or_a_list_of_channels(self) -> Self:
        if isinstance(self.channels, tuple) and self.channels:
            fields = SourceSpec.model_fields.items()
            if any(getattr(self, name) != field.default for name, field in fields if name != "channels"):
                msg = "source.channels lists files, so each has its own path and settings, and source has none"
                raise ValueError(msg)
            names = [channel.name for channel in self.channels]
            if len(set(names)) < len(names):
                msg = "two channels have the same name"
                raise ValueError(msg)
        elif not self.path:
            msg = "source.path is missing"
            raise ValueError(msg)
        elif self.channels and self.channel is not None:
            msg = "source.channel chooses one channel, source.channels all"
            raise ValueError(msg)
        return self


class ChannelSpec(SourceSpec):
    """One of several registered files that are channels of one volume."""

    name: ChannelName
    """Name of the channel, by which transfer functions name it; lower-case letters, digits, - and _."""

    @model_validator(mode="after")
    def _has_no_channels_of_its_own(self) -> Self:
        if self.channels:
            msg = f"channel {self.name} has channels of its own"
            raise ValueError(msg)
        return self


class GapRepair(Record):
    """Uneven distances of slices were made even: a new slice every `usual_gap_mm`, or as near as divides the whole."""

    kind: Literal["gaps"] = "gaps"
    """What was repaired."""
    interpolation: Literal["linear"] = "linear"
    """Interpolation between the two neighbouring slices. Integers are rounded to the nearest."""
    slices_before: Count
    """Number of slices of the source."""
    slices_after: Count
    """Number of slices that were made of them."""
    usual_gap_mm: Length
    """Lower median of the distances in the source, in millimetres."""
    largest_gap_mm: Length
    """Largest distance in the source, in millimetres."""


class TiltRepair(Record):
    """The slices of a tilted gantry were moved sideways within their planes, so that they lie above each other."""

    kind: Literal["tilt"] = "tilt"
    """What was repaired."""
    interpolation: Literal["linear"] = "linear"
    """Interpolation within each slice. Integers are rounded to the nearest."""
    about_rows_deg: float
    """Angle of the shear that was removed: from slice to slice along the columns, in degrees."""
    about_columns_deg: float
    """The same along the rows, in degrees."""
    added_rows: int
    """Number of rows by which the slices grew, so that nothing was cut off."""
    added_columns: int
    """Number of columns by which the slices grew."""
    padding: float
    """Physical value of the voxels that no slice covers: the lowest of the source."""


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
    level_set: bool = False
    """Whether the values are distances to a surface, negative inside."""
    label_numbers: tuple[int, ...] = ()
    """Labels above 255, renumbered: the number in the source of each code, the first for code 0."""
    repairs: tuple[GapRepair | TiltRepair, ...] = ()
    """What was repaired by interpolation because the scene asked for it, in the order in which it was done."""
    remarks: tuple[str, ...] = ()
    """What the reader noticed and a user should know: ignored files, missing attributes."""


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
        """Return the source itself."""
        ...

    def __exit__(self, *exception: object) -> None:
        """Close what is open."""
        ...


class SlicePlaces(Record):
    """Where slices lie that are parallel but form no grid."""

    folder: str
    """What holds them, for messages."""
    along_mm: tuple[float, ...]
    """Distance of each slice from the first, along the normal."""
    beside_mm_xy: tuple[tuple[float, float], ...]
    """Shift of each slice beside the first, along its index axes x and y."""
    repairs: tuple[RepairKind, ...]
    """What it takes to make them a volume."""


@runtime_checkable
class UnevenSource(Protocol):
    """Slices that form no grid. Not a `VolumeSource`: whoever takes it for one would draw a wrong volume."""

    @property
    def nominal(self) -> SourceInfo:
        """Type and photometry. Only the first slice lies where this grid says; the distance is the mean."""
        ...

    @property
    def places(self) -> SlicePlaces:
        """Where the slices lie."""
        ...

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], as they are in the files."""
        ...

    def __enter__(self) -> Self:
        """Return the source itself."""
        ...

    def __exit__(self, *exception: object) -> None:
        """Close what is open."""
        ...
