"""Geometry and pixel description from the header of one DICOM image, checked.

Reads only the attributes listed in `fields`, and keeps only the fields of `SliceImage`. Source: DICOM PS3.3, C.7.6.2
(image plane), C.7.6.3 (image pixel), C.11.1 (modality LUT).
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.codecs import DECODERS, EXPLICIT, IMPLICIT
from volprep_formats.readers.dicom.element import PixelElement
from volprep_formats.readers.dicom.fields import (
    CLOCKS,
    LARGEST_NUMBER,
    PRIVATE_TAGS,
    TAGS,
    VARIANTS,
    Elements,
    Fields,
    raw_value,
    variant_text,
)
from volprep_formats.source import ColourChannel, GreyOf

MAX_SLICE_PIXELS = 2**28
"""Larger declared slices (16384²) are refused before anything is allocated."""

_OWN = frozenset(
    (
        TAGS["SOPInstanceUID"],
        TAGS["ImagePositionPatient"],
        TAGS["InstanceNumber"],
        TAGS["InStackPositionNumber"],
        *(TAGS[keyword] for keyword in CLOCKS),
        *PRIVATE_TAGS,
    )
)
"""Attributes that differ from slice to slice, or that are not interpreted here."""

_MODALITIES = frozenset(
    ("CR", "CT", "DX", "IVUS", "MG", "MR", "NM", "OCT", "OPT", "OT", "PT", "RF", "RTDOSE", "SC", "SEG", "US", "XA")
)
_GREY = frozenset(("MONOCHROME1", "MONOCHROME2"))
_COLOURS = frozenset(("PALETTE COLOR", "RGB", "YBR_FULL", "YBR_FULL_422", "YBR_PARTIAL_420", "YBR_ICT", "YBR_RCT"))
_YBR = frozenset(("YBR_FULL", "YBR_FULL_422"))
"""Colours as luminance and two differences, PS3.3, C.7.6.3.1.2."""
_OF_JPEG_2000 = frozenset(("YBR_ICT", "YBR_RCT"))
"""Colours that JPEG 2000 transforms, and its decoder transforms back."""
_UNITS = {"HU": "HU", "BQML": "Bq/ml"}


Colours = Literal["", "pixels", "planes", "pairs"]


@dataclass(frozen=True)
class EncodedPixels:
    """Location and storage of the pixels of one picture: everything that a decoder needs."""

    path: Path
    transfer_syntax: str
    rows: int
    columns: int
    bits_allocated: int
    bits_stored: int
    high_bit: int
    signed: bool
    is_float: bool
    inverted: bool
    """MONOCHROME1: the lowest value is displayed white."""
    has_words: bool
    offset_bytes: int
    size_bytes: int
    is_bare: bool = False
    """The items of one frame of an encapsulated value, without its table and delimiter."""
    colours: Colours = ""
    """For pictures in colour: whether the three components of a pixel follow each other, or planes of one component do,
    or two luminances and the colour differences that two pixels share."""
    is_ybr: bool = False
    """For pictures in colour: whether the header says that the components are luminance and two colour differences."""
    grey: GreyOf | ColourChannel = "luminance"
    """Use of the colours: grey, or a channel of a volume in colour."""
    tile: tuple[int, int, int, int] | None = None
    """First row, first column, rows and columns of the slice within the picture; None if it is the whole picture."""


@dataclass(frozen=True)
class ValueTable:
    """A modality lookup table; see `value_table`."""

    first: int
    """Stored value of its first entry."""
    bits: int
    """Bits of each entry."""
    entries: bytes
    order: str
    """Byte order of entries of two bytes."""
    is_bytes: bool
    """Whether each entry is one byte."""


@dataclass(frozen=True)
class SliceImage:
    """One slice, alone in its file or one of many. Lengths in millimetres, world space LPS.

    Absent values are None.
    """

    path: Path
    number: int | None
    """Frame number in the file, from 1; None for a file of one slice."""
    series_uid: str
    """Only the characters of a UID; an invalid UID is escaped and is reported as a problem."""
    instance_uid: str
    """Compared, never shown."""
    frame_of_reference: str
    """UID of the coordinate system of its position; empty where the file does not say. Compared, never shown."""
    modality: str
    is_localiser: bool
    shape_yx: tuple[int, int]
    orientation: tuple[float, ...] | None
    """Unit vectors along a row (index x) and along a column (index y)."""
    position_mm_xyz: tuple[float, ...] | None
    """Centre of the first pixel."""
    pixel_spacing_mm_yx: tuple[float, ...] | None
    slice_thickness_mm: float | None
    spacing_between_slices_mm: float | None
    slope: float
    intercept: float
    unit: str
    has_padding: bool
    has_burned_in_text: bool
    variants: tuple[str, ...]
    """Values of `VARIANTS`. Compared with each other, never shown."""
    pixels: EncodedPixels | None
    problem: VolprepError | None
    """Reason why this image cannot be part of a volume; raised when its series is opened."""
    table: ValueTable | None = None
    """Modality LUT, which replaces slope and intercept."""
    has_real_world_values: bool = False
    """The header maps stored values to real-world ones, besides slope and intercept."""
    stack_position: str = ""
    """Number of the slice in its stack, from 1; empty if the header does not say."""
    instance_number: float | None = None
    """Number of the image in its series."""
    acquired: int | None = None
    """Number of images of the acquisition that it belongs to."""
    is_in_volume: bool = False
    """Whether its position is one in a volume, whose place in the patient is not known."""
    part: tuple[int, int] | None = None
    """Part number of the file in a concatenation, and the number of parts."""
    clocks: tuple[str, ...] = ("",) * len(CLOCKS)
    """Values of `CLOCKS`. Only differences of them are shown."""


def slice_image(path: Path, data: Elements, transfer_syntax: str, element: PixelElement) -> SliceImage:
    """Interpret the header of one slice. An error is stored in `problem`."""
    shared = tuple(item for item in data.items() if item[0] not in _OWN)
    like = _sound_image(shared, transfer_syntax, is_float=element.is_float, has_words=element.has_words)
    fields = Fields(path, data)
    position_mm_xyz = fields.numbers("ImagePositionPatient", 3)
    if like is None or like.pixels is None or fields.problem is not None or element.size_bytes is None:
        return interpreted(path, data, transfer_syntax, element)
    pixels = replace(like.pixels, path=path, offset_bytes=element.offset_bytes, size_bytes=element.size_bytes)
    instance_uid = fields.text("SOPInstanceUID")
    return replace(
        like,
        path=path,
        instance_uid=instance_uid,
        stack_position=variant_text(data, "InStackPositionNumber"),
        instance_number=fields.hint("InstanceNumber"),
        clocks=_clocks(data),
        position_mm_xyz=position_mm_xyz,
        pixels=pixels,
    )


# The headers of a series differ only in the attributes in _OWN.
@lru_cache(maxsize=64)
def _sound_image(
    shared: tuple[tuple[int, tuple[bytes, str]], ...], transfer_syntax: str, *, is_float: bool, has_words: bool
) -> SliceImage | None:
    """Interpret the attributes shared by all slices as a header; None if there is a problem."""
    element = PixelElement(is_float, has_words, offset_bytes=0, size_bytes=0, present_bytes=0, items=(), table=())
    image = interpreted(Path(), dict(shared), transfer_syntax, element)
    return image if image.problem is None else None


def interpreted(path: Path, data: Elements, transfer_syntax: str, element: PixelElement) -> SliceImage:
    """Interpret a header as `slice_image` does, without using the results of earlier headers."""
    fields = Fields(path, data)
    series_uid = fields.uid("SeriesInstanceUID")
    pixels = _pixels(fields, transfer_syntax, element)
    image_type = fields.text("ImageType").upper()
    modality = fields.text("Modality")
    slope, intercept, unit = _photometry(fields, modality)
    orientation = fields.numbers("ImageOrientationPatient", 6)
    position_mm_xyz = fields.numbers("ImagePositionPatient", 3)
    pixel_spacing_mm_yx = pixel_spacing(fields)
    if pixels is not None and pixels.colours:
        _refuse_colours(fields)  # last: colours are not a problem if they will be converted to grey
    return SliceImage(
        path=path,
        number=None,
        series_uid=series_uid,
        instance_uid=fields.text("SOPInstanceUID"),
        frame_of_reference=fields.text("FrameOfReferenceUID"),
        modality=modality if modality in _MODALITIES else "",
        is_localiser="LOCALIZER" in image_type or "SCOUT" in image_type,
        shape_yx=(int(fields.number("Rows") or 0), int(fields.number("Columns") or 0)),
        orientation=orientation,
        position_mm_xyz=position_mm_xyz,
        pixel_spacing_mm_yx=pixel_spacing_mm_yx,
        slice_thickness_mm=fields.hint("SliceThickness"),
        spacing_between_slices_mm=fields.hint("SpacingBetweenSlices"),
        slope=slope,
        intercept=intercept,
        unit=unit,
        has_padding=raw_value(data, "PixelPaddingValue")[0] != b"",
        has_burned_in_text=fields.text("BurnedInAnnotation").upper() == "YES",
        variants=tuple(variant_text(data, keyword) for keyword in VARIANTS),
        stack_position=variant_text(data, "InStackPositionNumber"),
        pixels=pixels,
        problem=fields.problem,
        instance_number=fields.hint("InstanceNumber"),
        acquired=_whole(fields.hint("ImagesInAcquisition")),
        part=_part(fields),
        clocks=_clocks(data),
    )


def _clocks(data: Elements) -> tuple[str, ...]:
    return tuple(variant_text(data, keyword) for keyword in CLOCKS)


def _photometry(fields: Fields, modality: str) -> tuple[float, float, str]:
    """Return slope, intercept and unit of the values. A dose has a scaling instead, without which it has no unit."""
    keyword = "DoseGridScaling" if modality == "RTDOSE" else "RescaleSlope"
    slope = fields.number(keyword)
    if slope == 0.0:
        fields.refuse("VP1037", keyword=keyword, wanted="a number other than 0")
    if modality == "RTDOSE":
        is_gray = slope is not None and fields.text("DoseUnits").upper() == "GY"
        return (1.0 if slope is None else slope), 0.0, "Gy" if is_gray else ""
    intercept = fields.number("RescaleIntercept")
    unit = unit_of(fields, modality, rescaled=intercept is not None)
    return (1.0 if slope is None else slope), (0.0 if intercept is None else intercept), unit


def _whole(number: float | None) -> int | None:
    return None if number is None or number != int(number) else int(number)


def _part(fields: Fields) -> tuple[int, int] | None:
    """Part number in a concatenation (PS3.3, C.7.6.16.2.2.4), or None if the file is not part of one."""
    number, total = (_whole(fields.hint(f"InConcatenation{value}")) for value in ("Number", "TotalNumber"))
    return None if number is None or total is None else (number, total)


def _pixels(fields: Fields, transfer_syntax: str, element: PixelElement) -> EncodedPixels | None:
    """Check how the pixels are stored, the most basic properties first."""
    rows, columns = fields.count("Rows", 1, 65535), fields.count("Columns", 1, 65535)
    photometric = fields.text("PhotometricInterpretation").upper()
    colours: Colours = ""
    if fields.count("SamplesPerPixel", 1, 4) != 1 or photometric in _COLOURS:
        colours = _stored_colours(fields, transfer_syntax, is_float=element.is_float)
        if not colours:
            _refuse_colours(fields)
    elif photometric not in _GREY:
        fields.refuse("VP1037", keyword="PhotometricInterpretation", wanted="MONOCHROME1 or MONOCHROME2")
    allocated = fields.count("BitsAllocated", 1, 64)
    if allocated == 1 and fields.text("Modality") == "SEG":
        fields.refuse("VP1053")
    elif allocated not in ({32, 64} if element.is_float else {8, 16, 32}):
        fields.refuse("VP1043", bits=f"{allocated}-bit {'floating-point ' if element.is_float else ''}pixels")
    stored, high_bit, signed = allocated, allocated - 1, True
    if not element.is_float:
        stored = fields.count("BitsStored", 1, allocated)
        high = fields.number("HighBit")
        high_bit = stored - 1 if high is None else fields.count("HighBit", stored - 1, allocated - 1)
        signed = fields.count("PixelRepresentation", 0, 1) == 1
    if rows * columns > MAX_SLICE_PIXELS:
        fields.refuse("VP1044", rows=rows, columns=columns, limit=MAX_SLICE_PIXELS)
    if fields.problem is not None:
        return None
    if element.size_bytes is None:
        fields.refuse("VP1031", what=f"only {element.present_bytes} bytes of its pixel data are there")
        return None
    return EncodedPixels(
        path=fields.path,
        transfer_syntax=transfer_syntax,
        rows=rows,
        columns=columns,
        bits_allocated=allocated,
        bits_stored=stored,
        high_bit=high_bit,
        signed=signed,
        is_float=element.is_float,
        inverted=photometric == "MONOCHROME1",
        colours=colours,
        is_ybr=photometric in _YBR,
        has_words=element.has_words,
        offset_bytes=element.offset_bytes,
        size_bytes=element.size_bytes,
    )


def _stored_colours(fields: Fields, transfer_syntax: str, *, is_float: bool) -> Colours:
    """Layout of colours that can be read: three components of whole bytes or words; empty for others."""
    bits, photometric = fields.number("BitsAllocated"), fields.text("PhotometricInterpretation").upper()
    whole = bits in {8.0, 16.0} and fields.number("BitsStored") == bits and fields.number("PixelRepresentation") == 0
    if is_float or not whole or fields.number("SamplesPerPixel") != 3.0 or (photometric in _YBR and bits != 8.0):
        return ""
    if transfer_syntax in DECODERS:
        return "pixels" if photometric in {"RGB", *_YBR, *_OF_JPEG_2000} else ""
    order = fields.number("PlanarConfiguration")
    if transfer_syntax not in {IMPLICIT, EXPLICIT} or order not in {0, 1}:
        return ""
    if photometric == "YBR_FULL_422":
        return "pairs" if (fields.number("Columns") or 0.0) % 2 == 0 and not order else ""
    if photometric not in {"RGB", "YBR_FULL"}:
        return ""
    return "planes" if order else "pixels"


def _refuse_colours(fields: Fields) -> None:
    photometric = fields.text("PhotometricInterpretation").upper()
    fields.refuse("VP1035", kind=photometric if photometric in _COLOURS else "several samples per pixel")


def pixel_spacing(fields: Fields) -> tuple[float, ...] | None:
    """Distances between rows and between columns, checked; None when missing or wrong."""
    spacing = fields.numbers("PixelSpacing", 2)
    if spacing is not None and not all(1.0 / LARGEST_NUMBER <= s <= LARGEST_NUMBER for s in spacing):
        fields.refuse("VP1037", keyword="PixelSpacing", wanted="two lengths above 0 mm")
        return None
    return spacing


def unit_of(fields: Fields, modality: str, *, rescaled: bool) -> str:
    """Unit of the rescaled values. A rescaled CT without a unit is in Hounsfield units (C.11.1.1.2)."""
    said = fields.text("RescaleType") or fields.text("Units")
    if modality == "CT" and rescaled and not said:
        return "HU"
    return _UNITS.get(said.upper(), "")
