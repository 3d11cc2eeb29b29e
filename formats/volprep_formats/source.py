"""The result of every reader: one volume at full precision, readable slab by slab."""

from pathlib import Path
from typing import Annotated, Literal, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, model_validator

from volprep_formats.grid import LONGEST_AXIS, Affine, Count, Grid, Length
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.path_text import path_of_text, path_text
from volprep_formats.record import Record
from volprep_formats.repairs import GapRepair, OtherRepair, TiltRepair

StoredType = Literal["uint8", "int16", "uint16", "float32"]
"""Voxel types that volprep computes with. A reader converts others to the smallest of these that holds them."""
SourceFormat = Literal[
    "analyze",
    "auto",
    "dicom",
    "metaimage",
    "mgh",
    "minc",
    "mosaic",
    "mrc",
    "mrtrix",
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
FrameChoice = Literal["all"] | Count | Annotated[str, Field(pattern=r"^([1-9][0-9]{0,5}:){1,2}[1-9][0-9]{0,5}$")]
"""Frames of a series: all, every so many, or first:last:step, numbered from 1."""
RepairKind = Literal["gaps", "tilt"]
"""Repairs of slices that do not form a grid."""
GreyOf = Literal["luminance", "red", "green", "blue"]
"""Conversion of three colours to the value of a voxel."""

FiniteRow = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
"""Row of a matrix."""
Unit = Annotated[float, Field(ge=0.0, le=1.0)]
"""A number from 0 to 1."""
ColourPart = Literal["red", "green", "blue", "opacity"]
"""Channel of a colour volume."""
OpacityOf = Literal["alpha", "luminance", "red", "green", "blue", "background"]
"""Number, from 0 to 1, that the opacity of a colour pixel follows."""

LARGEST_NUMBER = 2**53 - 1
"""Largest number of a label. Numbers beyond it are not exact as 64-bit floating point, nor in JSON."""
ROUNDED = "wide integers are rounded to 32-bit floating point"
"""Beginning of the remark about integers that are too wide."""

SUV_UNIT = "g/ml"
"""Unit of standardised uptake values by body weight."""
_NAMES = ("series", "channel", "grid", "label_table")
"""Fields of a source with untrusted names, which may be names of a patient."""


class ColourChannel(Record):
    """One channel of pictures in colour: premultiplied linear light, or the extinction that it is multiplied by."""

    part: ColourPart | Literal["all"]
    """Which channel. "all" reads the four as one number of 64 bits, red in the lowest: a picture is decoded once."""
    opacity_of: OpacityOf
    """Number that decides the extinction of a pixel. "luminance": 0.299 red + 0.587 green + 0.114 blue of the sRGB
    colour. "background": distance of the sRGB colour from `background`, divided by the root of 3."""
    background: tuple[Unit, Unit, Unit] | None = None
    """The sRGB colour whose distance counts."""
    shares: Annotated[tuple[tuple[Unit, Unit], ...], Field(min_length=1, max_length=64)]
    """Share of the largest extinction over that number: ascending points, linear between them, constant outside."""

    @property
    def dtype(self) -> Literal["uint16", "uint64"]:
        """Type of the values that a reader gives."""
        return "uint64" if self.part == "all" else "uint16"


class RawLayout(Record):
    """Facts that a file without a header lacks."""

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
    """Facts about a volume that its pictures lack."""

    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance from picture to picture, from row to row and from column to column, in millimetres."""
    gaps: Literal["refuse", "ignore"] = "refuse"
    """Treatment of missing numbers in the names of the pictures. "ignore" takes the pictures that exist as neighbours,
    all at the same distance."""


class ArrayLayout(Record):
    """Facts that a NumPy file lacks: its array has axes z, y and x, and no spacing."""

    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance between voxel centres, in millimetres."""
    name: str | None = None
    """Name of the array, where a .npz file holds several."""


class TileLayout(Record):
    """Layout of the slices of a volume in one picture: row by row, from the top left."""

    tiles_x: Count
    """Number of tiles beside each other."""
    tiles_y: Count
    """Number of tiles above each other."""
    slices: Count
    """Number of tiles that are slices; the tiles after them may hold anything."""
    spacing_mm_zyx: tuple[Length, Length, Length] = (1.0, 1.0, 1.0)
    """Distance from slice to slice, from row to row and from column to column, in millimetres."""


class SourceSpec(Record):
    """Location of a scan and its reading options: the table [source] of a scene."""

    path: str = ""
    """File or folder. A relative path starts at the folder of the scene file. A path of bytes that are not UTF-8 is a
    file URI, file:///scans/%FF.nii."""
    channels: "Literal['all'] | tuple[ChannelSpec, ...]" = ()
    """Several channels of one volume. "all": all that the file has (OME, packages, the volumes of a NIfTI file), under
    their own names if it has names. Or a list of registered files, each with its own path and settings. If absent, the
    source is one channel."""
    format: SourceFormat = "auto"
    """Reader to use; "auto" looks at the file."""
    labels: bool | None = None
    """Whether voxels are labels: integers that name structures. They are never rounded or averaged. Where a number is
    above 255, all are replaced by codes from 0 on, in ascending order, and transfer functions refer to the codes. If
    absent, only a scan without a scene is analysed, and the build reports the result."""
    label_table: str | None = None
    """Names and colours of labels: "freesurfer", "slicer", "itksnap", or a file of one of these programs, a dseg.tsv of
    BIDS, an atlas XML, or lines of number and name. Only a scan without transfer functions is coloured by it. If
    absent, a table of the same name beside the scan, or FreeSurfer's where the numbers are its own."""
    series: str | None = None
    """DICOM: SeriesInstanceUID, or a unique ending of it, when the folder holds several series. OME: name of the image,
    or its number from 1, when there are several."""
    volume: Count | None = None
    """DICOM, NIfTI, NRRD, MetaImage, MRtrix, FreeSurfer, Analyze, MINC, OME, stacks of ImageJ, folders of volumes:
    number of the volume to read, from 1, if there are several: time points, echoes, components, stacks of slices."""
    frames: FrameChoice | None = None
    """DICOM, NIfTI, NRRD, MetaImage, MINC, NumPy, OME, stacks of ImageJ, folders of volumes: the volumes that are
    frames of a time series, numbered from 1. "all", a number for every so many, or "first:last" or "first:last:step".
    If absent, one volume is read."""
    volumes_by: Literal["number"] | None = None
    """DICOM only: attribute that distinguishes the volumes of a series if no other one does. "number": InstanceNumber,
    as for time points of scanners that write nothing else."""
    channel: str | Count | None = None
    """OME, packages, stacks of ImageJ: name of the channel, or its number from 1, when there are several."""
    level: Annotated[int, Field(ge=0, le=LONGEST_AXIS)] | None = None
    """OME-Zarr, packages: number of the resolution to read; if absent, the finest one."""
    missing: Literal["fill"] | None = None
    """OME-Zarr only: treatment of missing chunks. Writers leave out chunks that hold only the fill value, but an
    incomplete copy lacks chunks, too: the store is refused if more than a quarter is missing. "fill" reads all missing
    chunks as the fill value."""
    repair: tuple[RepairKind, ...] = ()
    """DICOM only: errors to repair by interpolation if slices do not form a grid. "gaps": missing slices and uneven
    distances. "tilt": a tilted gantry. If absent, such a series is refused."""
    suv: bool = False
    """DICOM PET only: whether activity becomes SUV by body weight (g/ml), if the header says dose, weight and times. If
    it does not, the values stay, and a remark names the missing attribute."""
    rgb: GreyOf | None = None
    """DICOM, stacks of pictures, mosaics: conversion of colours. "luminance" makes them grey, 0.299 red + 0.587 green +
    0.114 blue; "red", "green" and "blue" select one of them. If absent, pictures in colour are refused."""
    colour: ColourChannel | None = None
    """Stacks of pictures, DICOM, OME, NIfTI, NRRD, MetaImage, VTK, OpenVDB, NumPy: one channel of a colour volume. The
    table [colour] of a scene sets it."""
    grid: str | None = None
    """OpenVDB only: name of the grid, when the file holds several."""
    mask: str | None = None
    """File of a mask with the same voxels; a relative path starts at the folder of the scene file. Where it is 0, the
    scan is set to the value `outside` before any processing, so that no level, normal, table, mesh or preview contains
    the original values."""
    outside: FiniteFloat | None = None
    """Physical value of the voxels that a mask removes. If absent, the least value of the scan, which is then read
    twice."""
    nan: Literal["outside"] | FiniteFloat | None = None
    """Value of voxels that are not a number: a physical value, or "outside" for the value of that key. If absent,
    they are refused."""
    raw: RawLayout | None = None
    """Raw only: shape, type, spacing, byte order and header size."""
    stack: StackLayout | None = None
    """Stack of pictures only: spacing, and whether numbers may be missing."""
    array: ArrayLayout | None = None
    """NumPy only: spacing, and the name of the array."""
    mosaic: TileLayout | None = None
    """Mosaic only: number of tiles in the picture, number of slices among them, and the spacing."""

    def frame_numbers(self, count: int) -> range:
        """Return the numbers of the chosen frames of `count`, from 1; empty if the last one is not there."""
        if not isinstance(self.frames, str) or self.frames == "all":
            return range(1, count + 1, self.frames if isinstance(self.frames, int) else 1)
        first, last, *step = (int(word) for word in self.frames.split(":"))
        return range(first, last + 1, *step) if last <= count else range(0)

    def at_frame(self, number: int | None = None) -> Self:
        """Return the source of one frame of a series, the first chosen one if None; any other source as it is."""
        if self.frames is None:
            return self
        first = int(self.frames.split(":")[0]) if isinstance(self.frames, str) and self.frames != "all" else 1
        return self.model_copy(update={"frames": None, "volume": number or first})

    def place(self, base: Path) -> Path:
        """Return the path of the file or folder; a relative one starts at `base`."""
        return base / path_of_text(self.path)

    def mask_place(self, base: Path) -> Path | None:
        """Return the path of the mask, if there is one; a relative one starts at `base`."""
        return None if self.mask is None else base / path_of_text(self.mask)

    def places(self) -> tuple[Path, ...]:
        """Return the paths of all input files, which are absolute in a resolved scene."""
        mask = self.mask_place(Path())
        return (self.place(Path()),) if mask is None else (self.place(Path()), mask)

    def resolved(self, base: Path, instead: Path | None = None) -> Self:
        """Return the same source with absolute paths: they start at `base`, and `instead` replaces that of the scan."""
        mask = self.mask_place(base)
        table = self.label_table
        if table is not None and table not in LABEL_TABLES:
            table = path_text(base / path_of_text(table))
        where = instead.absolute() if instead is not None else self.place(base)
        places = {"path": path_text(where), "mask": None if mask is None else path_text(mask), "label_table": table}
        return self.model_copy(update=places)

    def without_place(self) -> Self:
        """Return the same source without paths and selectors: these are untrusted names."""
        if isinstance(self.channels, tuple) and self.channels:
            return self.model_copy(update={"channels": tuple(channel.without_place() for channel in self.channels)})
        mask = None if self.mask is None else "mask"
        return self.model_copy(update={"path": "imported", "mask": mask, **dict.fromkeys(_NAMES)})

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
        elif self.frames is not None and self.volume is not None:
            msg = "source.frames chooses frames of a series, source.volume one volume"
            raise ValueError(msg)
        elif self.frames is not None and self.channels:
            msg = "source.frames is for a source of one channel"
            raise ValueError(msg)
        elif self.channels and self.channel is not None:
            msg = "source.channel chooses one channel, source.channels all"
            raise ValueError(msg)
        return self


class ChannelSpec(SourceSpec):
    """One of several registered files that are channels of one volume."""

    name: ChannelName
    """Name of the channel, which transfer functions use; lower-case letters, digits, - and _."""
    transform: (
        tuple[FiniteRow, FiniteRow, FiniteRow, tuple[Literal[0], Literal[0], Literal[0], Literal[1]]] | str | None
    ) = None
    """Registration: rows of the 4×4 matrix that takes places of this file to places of the first channel, both in
    millimetres of the patient's space (LPS), or the file of a registration: of ITK, FLIRT or DICOM. If absent, both are
    in one frame of reference."""

    def placed(self, registration: Affine | None) -> Self:
        """Return the same channel with the matrix of a registration, or with none."""
        return self.model_copy(update={"transform": registration and (*registration, (0, 0, 0, 1))})

    @property
    def affine(self) -> Affine | None:
        """The first three rows of `transform`, whose file has been read."""
        return None if self.transform is None or isinstance(self.transform, str) else self.transform[:3]

    @model_validator(mode="after")
    def _has_no_channels_of_its_own(self) -> Self:
        if self.channels:
            msg = f"channel {self.name} has channels of its own"
            raise ValueError(msg)
        if self.frames is not None:
            msg = f"channel {self.name} has frames, which are for a source of one channel"
            raise ValueError(msg)
        return self


class SourceInfo(Record):
    """Facts from the header of a source. None of them can name a patient."""

    format: str
    """Name of the reader: dicom, raw, ..."""
    grid: Grid
    """Positions of the voxels."""
    stored_type: StoredType
    """Type of the values that read_slab returns."""
    slope: float = 1.0
    """physical = slope · stored + intercept."""
    intercept: float = 0.0
    """physical = slope · stored + intercept."""
    unit: str = ""
    """Unit of the physical values, for example HU; empty if the source has none."""
    modality: str = ""
    """DICOM modality, for example CT or MR; empty if the source has none."""
    level_set: bool = False
    """Whether the values are distances to a surface, negative inside."""
    label_numbers: tuple[Annotated[int, Field(ge=1 - 2**53, le=2**53 - 1)], ...] = ()
    """Labels above 255, renumbered: the number in the source of each physical value of the package, the first for 0."""
    repairs: tuple[GapRepair | TiltRepair | OtherRepair, ...] = ()
    """Repairs by interpolation that the scene requests, in order."""
    remarks: tuple[str, ...] = ()
    """Remarks of the reader: ignored files, missing attributes."""


class VolumeSource(Protocol):
    """An open source. Use it as a context manager."""

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry, known before any voxel is read."""

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x] in native byte order, of type `info.stored_type`.

        Raises VolprepError when the source is damaged.
        """

    def __enter__(self) -> Self:
        """Return the source itself."""

    def __exit__(self, *exception: object) -> None:
        """Close open files."""


@runtime_checkable
class UnroundedSource(Protocol):
    """A source that also gives the numbers of its file, which may be wider than `info.stored_type`."""

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry."""

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], in the type of the file.

        Raises what `read_slab` raises.
        """


def read_labels(source: VolumeSource, z0: int, z1: int) -> NDArray[np.generic]:
    """Return the stored values of slices z0 to z1 - 1 as [z, y, x], not rounded to the stored type.

    Numbers of labels may be larger than 2^24, beyond which 32-bit floating point does not have all of them.
    """
    return source.read_unrounded(z0, z1) if isinstance(source, UnroundedSource) else source.read_slab(z0, z1)
