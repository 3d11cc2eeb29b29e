"""Descriptions of the pages of a TIFF file that ImageJ, OME and tifffile write into its first page.

Sources: FileSaver, TiffEncoder and FileOpener of ImageJ 1.54 (https://github.com/imagej/ImageJ); the OME model,
Pixels; tifffile's description of an array, a JSON object with its shape.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.time_axis import seconds_per

FM_PER_MM = 10**12
"""Femtometres in a millimetre."""
_FM_PER_UNIT = {
    **dict.fromkeys(("um", "µm", "μm", "\\u00b5m", "micron", "microns"), 1e9),
    "nm": 1e6,
    "mm": 1e12,
    "cm": 1e13,
    "m": 1e15,
    **dict.fromkeys(("in", "inch"), 25.4e12),
}
_UNIT_OF_TAG = {"in": ("in", "inch"), "cm": ("cm",)}
"""Units of the description that agree with one of the resolution; others do not agree."""
_LEAST_FM, _MOST_FM = 1.0, 1e18


@dataclass(frozen=True)
class PixelDensity:
    """Resolution tags of a TIFF page."""

    x: float
    """Pixels per unit along a row; 0 if absent."""
    y: float
    """Pixels per unit along a column; 0 if absent."""
    unit: str
    """"in", "cm" or "none"."""


_LONGEST_FRAME_US = 1e15


@dataclass(frozen=True)
class StackOrder:
    """How the images of a stack make volumes: channels are fastest, then slices, then frames."""

    images: int
    """Number of images, which may be more than the pages of a file of ImageJ above 4 GB."""
    channels: int = 1
    frames: int = 1
    frame_us: int = 0
    """Microseconds from frame to frame; 0 if the description does not say."""


def order_of(path: Path, description: str, shape: tuple[int, int, int, int]) -> StackOrder:
    """Return the order of the images; `shape` is pages, rows, columns and channels.

    Raises VP1168 for pages that are not slices of volumes.
    """
    if description.startswith("ImageJ="):
        order, says = _of_imagej(description, shape[0])
    else:
        order, says = StackOrder(shape[0]), _says(description, shape)
    if says is not None:
        raise VolprepError("VP1168", path=path, pages=shape[0], says=says)
    return order


def _of_imagej(description: str, pages: int) -> tuple[StackOrder, str | None]:
    """Return the order that ImageJ describes, and the description if it does not fit the pages."""
    found = re.findall(r"^(images|channels|slices|frames)=(\d{1,9})", description, re.MULTILINE)
    counts = {name: max(int(count), 1) for name, count in found}
    images = counts.get("images", pages)
    channels, frames = counts.get("channels", 1), counts.get("frames", 1)
    slices = counts.get("slices", images // (channels * frames))
    says = ", ".join(f"{count} {name}" for name, count in {"images": images, **counts}.items())
    # A file above 4 GB has one page for all images.
    fits = pages in {images, 1} and channels * slices * frames == images
    return StackOrder(images, channels, frames, _frame_us(description)), None if fits else says


def _frame_us(description: str) -> int:
    """Return the distance of frames that ImageJ describes, in microseconds; 0 if it is missing."""
    found = re.search(r"^finterval=([0-9.eE+-]{1,40})\s*$", description, re.MULTILINE)
    unit = re.search(r"^tunit=(\S{1,40})\s*$", description, re.MULTILINE)
    try:
        time_us = 1e6 * float(found[1] if found else 0.0) * (seconds_per(unit[1] if unit else "s") or 0.0)
    except ValueError:
        return 0
    return round(time_us) if 0.0 < time_us < _LONGEST_FRAME_US else 0


def spacing_fm_zyx(description: str, resolution: PixelDensity) -> tuple[int, int, int] | None:
    """Return the distances between the voxels of a stack of ImageJ, in femtometres; None if it does not say them.

    As in ImageJ, an absent `spacing` is one unit, and `yunit` and `zunit` are written where they differ from `unit`. A
    stack without a unit that ImageJ knows as a length says nothing, nor does one whose resolution has another unit than
    its description.
    """
    if not description.startswith("ImageJ="):
        return None
    given: dict[str, str] = dict(re.findall(r"^(unit|yunit|zunit|spacing)=(\S{1,40})\s*$", description, re.MULTILINE))
    unit = given.get("unit", "")
    units_zyx = [given.get(name, unit).lower() for name in ("zunit", "yunit", "unit")]
    of_tag = _UNIT_OF_TAG.get(resolution.unit)
    if of_tag is not None and not set(units_zyx[1:]) <= set(of_tag):
        return None
    if min(resolution.x, resolution.y) <= 0.0:
        return None
    try:
        depth = abs(float(given.get("spacing", "1")))
    except ValueError:
        return None
    sizes = (depth, 1.0 / resolution.y, 1.0 / resolution.x)
    z, y, x = (size * _FM_PER_UNIT.get(unit, 0.0) for size, unit in zip(sizes, units_zyx, strict=True))
    if not all(_LEAST_FM <= size <= _MOST_FM for size in (z, y, x)):
        return None
    return round(z), round(y), round(x)


def _says(description: str, shape: tuple[int, int, int, int]) -> str | None:
    """Return how a description contradicts that all pages are slices; None if it does not."""
    if description.startswith("{"):
        return _says_of_array(description, shape)
    if "<OME" not in description:
        return None
    found = re.findall(r"\bSize([CT])=[\"'](\d{1,9})[\"']", description)
    several = [f"{count} {name}" for name, count in found if int(count) > 1]
    return ", ".join([f"{shape[0]} images", *several]) if several else None


def _says_of_array(description: str, shape: tuple[int, int, int, int]) -> str | None:
    """Return the shape of an array that has more axes than a volume and its channels."""
    _, rows, columns, channels = shape
    try:
        found = json.loads(description).get("shape")
    except (ValueError, RecursionError, AttributeError):
        return None
    if not isinstance(found, list) or not 2 <= len(found) <= 16 or not all(isinstance(n, int) for n in found):
        return None
    of_a_page = [[rows, columns], [rows, columns, channels], [channels, rows, columns]]
    around = [found[: -len(value)] for value in of_a_page if found[-len(value) :] == value]
    if not around or sum(n > 1 for n in min(around, key=len)) < 2:
        return None
    return f"an array of {'×'.join(map(str, found))} values"
