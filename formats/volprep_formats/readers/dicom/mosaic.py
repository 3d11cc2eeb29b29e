"""Siemens mosaics: one picture that holds the slices of a volume as tiles, row by row.

The header gives the position of the whole picture as if it were one large slice around the same middle. The number of
tiles and the direction of the slices are in private elements only: NumberOfImagesInMosaic and, within the CSA header,
SliceNormalVector. Nothing else of the CSA header is kept. Source: its layout as documented by NiBabel ("Siemens format
DICOM with CSA header"); the manufacturer publishes none.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.dicom.fields import (
    CSA_CREATOR,
    CSA_HEADER,
    MOSAIC_COUNT,
    MOSAIC_CREATOR,
    Elements,
    raw_element,
    raw_text,
)
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE

_MOST_TILES = 2**12
_MOST_TAGS = 2**10
_MOST_ITEMS = 2**10


def is_mosaic(data: Elements) -> bool:
    """Whether the header declares a mosaic."""
    return "MOSAIC" in raw_text(data, "ImageType").upper().split("\\")


def mosaic_slices(image: SliceImage, data: Elements) -> tuple[SliceImage, ...]:
    """Return the slices of the mosaic `image`, or the image itself with its problem."""
    if image.problem is not None or image.pixels is None:
        return (replace(image, pixels=None),)
    try:
        return _slices(image, data)
    except VolprepError as error:
        return (replace(image, problem=error),)


def _slices(image: SliceImage, data: Elements) -> tuple[SliceImage, ...]:
    counts, normal = _counts_and_normal(data)
    if len(counts) > 1:
        said = " and ".join(str(c) for c in sorted(counts))
        raise VolprepError("VP1042", path=image.path, what=f"its private header says that it holds {said} slices")
    count = next(iter(counts), None)
    if image.pixels is None or count is None or normal is None:
        missing = "how many slices it holds" if count is None else "which way its slices follow each other"
        raise VolprepError("VP1042", path=image.path, what=f"its private header does not say {missing}")
    across = math.isqrt(count - 1) + 1
    shape_yx = (image.shape_yx[0] // across, image.shape_yx[1] // across)
    if (shape_yx[0] * across, shape_yx[1] * across) != image.shape_yx:
        size = f"{image.shape_yx[1]}×{image.shape_yx[0]}"
        raise VolprepError("VP1042", path=image.path, what=f"{count} slices do not fit into {size} pixels")
    for keyword, value in (
        ("ImageOrientationPatient", image.orientation),
        ("ImagePositionPatient", image.position_mm_xyz),
        ("PixelSpacing", image.pixel_spacing_mm_yx),
        ("SpacingBetweenSlices", image.spacing_between_slices_mm),
    ):
        if value is None:
            raise VolprepError("VP1036", path=image.path, keyword=keyword)
    plane = np.reshape(np.array(image.orientation), (2, 3))
    along = np.cross(*plane)
    if not math.isclose(abs(along @ normal), 1.0, abs_tol=ORIENTATION_TOLERANCE):
        raise VolprepError(
            "VP1042", path=image.path, what=SafeText("the normal of its slices is not that of the picture")
        )
    # The sign alone is taken: the cross product is as exact as the header is.
    step = along * math.copysign(abs(image.spacing_between_slices_mm or 0.0), along @ normal)
    spacing_yx = np.array(image.pixel_spacing_mm_yx)
    beside_xy = spacing_yx[::-1] * (np.array(image.shape_yx) - shape_yx)[::-1] / 2
    first = np.array(image.position_mm_xyz) + beside_xy @ plane
    return tuple(
        replace(
            image,
            number=k + 1,
            shape_yx=shape_yx,
            position_mm_xyz=tuple((first + k * step).tolist()),
            pixels=replace(image.pixels, tile=(k // across * shape_yx[0], k % across * shape_yx[1], *shape_yx)),
        )
        for k in range(count)
    )


def _counts_and_normal(data: Elements) -> tuple[set[int], tuple[float, ...] | None]:
    """All that NumberOfImagesInMosaic is said to be, as far as it is sound, and SliceNormalVector if it is there."""
    counts: set[int] = set()
    normal: tuple[float, ...] | None = None
    value, order = raw_element(data, MOSAIC_COUNT)
    if len(value) == 2 and _creator(data, MOSAIC_CREATOR) == b"SIEMENS MR HEADER":
        counts.update(struct.unpack(order + "H", value))
    if _creator(data, CSA_CREATOR) == b"SIEMENS CSA HEADER":
        header = raw_element(data, CSA_HEADER)[0]
        wanted = {name: numbers for name, numbers in _csa_numbers(header) if numbers}
        vector = wanted.get("SliceNormalVector", ())
        normal = vector if len(vector) == 3 else None
        counted = wanted.get("NumberOfImagesInMosaic", ())
        if len(counted) == 1 and counted[0].is_integer():
            counts.add(int(counted[0]))
    return {count for count in counts if 1 <= count <= _MOST_TILES}, normal


def _creator(data: Elements, tag: int) -> bytes:
    """Name of who owns a block of private elements."""
    return raw_element(data, tag)[0].strip(b" \0")


def _csa_numbers(header: bytes) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Return the two needed entries of a CSA header, as far as it is valid.

    Each entry is a name of 64 bytes, five numbers (the fourth counts the items), and the items: four numbers, including
    the length, and the text, padded to a multiple of four bytes.
    """
    is_second = header[:4] == b"SV10"
    at = 8 if is_second else 0
    if len(header) < at + 8:
        return
    (entries,) = struct.unpack_from("<I", header, at)
    at += 8
    first_items: int | None = None
    for _ in range(min(entries, _MOST_TAGS)):
        if at + 84 > len(header):
            return
        name = header[at : at + 64].split(b"\0")[0]
        (items,) = struct.unpack_from("<I", header, at + 76)
        at += 84
        if first_items is None:
            first_items = items
        texts = []
        for _ in range(min(items, _MOST_ITEMS)):
            if at + 16 > len(header):
                return
            lengths = struct.unpack_from("<4i", header, at)
            # In the first version the lengths are off by the number of items of the first entry.
            length = lengths[1] if is_second else lengths[0] - first_items
            at += 16
            if not 0 <= length <= len(header) - at:
                return
            texts.append(header[at : at + length].strip(b" \0"))
            at += -(-length // 4) * 4
        if name in {b"SliceNormalVector", b"NumberOfImagesInMosaic"}:
            yield name.decode(), _numbers(texts)


def _numbers(texts: list[bytes]) -> tuple[float, ...]:
    try:
        numbers = tuple(float(text) for text in texts if text)
    except ValueError:
        return ()
    return numbers if all(math.isfinite(n) for n in numbers) else ()
