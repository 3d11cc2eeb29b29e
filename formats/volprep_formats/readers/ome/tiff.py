"""OME-TIFF: one channel at one time point of one image, its slices being pages of one file or of several.

The axes come from the OME-XML, in any order; samples of a pixel count as channels. Source: "OME-TIFF specification"
(https://docs.openmicroscopy.org/ome-model/).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.isolation import Workers, workers
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import colour_remarks, of_colour
from volprep_formats.readers.colour_samples import ColourSamples, OneSample
from volprep_formats.readers.decoded_source import DecodedSource
from volprep_formats.readers.ome.channels import chosen, grid_of, mm_per_unit
from volprep_formats.readers.ome.metadata import (
    Attributes,
    Description,
    Image,
    Sizes,
    parse_description,
    planes_of,
    sizes_of,
)
from volprep_formats.readers.ome.pages import Pages, TiffPage, decode_request, description_in, pages_of, pages_request
from volprep_formats.readers.pictures.file import pages_at_once
from volprep_formats.readers.time_axis import TimeAxis, seconds_per
from volprep_formats.readers.voxel_source import stored_type_of
from volprep_formats.regular_files import is_there
from volprep_formats.source import SourceInfo, SourceSpec

_DTYPES = {"float": "float32", "double": "float64"}
_READ = frozenset(("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"))
_USUAL_UNIT = "µm"
_SAMPLE_NAMES = {2: ("1", "2"), 3: ("red", "green", "blue"), 4: ("red", "green", "blue", "alpha")}


class OmeTiffSource(DecodedSource):
    """Pages of the same size and type, decoded slab by slab in worker processes."""

    def __init__(self, info: SourceInfo, slices: "_Slices") -> None:
        super().__init__(info)
        self._slices = slices

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x]. Raises VP1165 (damaged) and VP1270 to VP1273."""
        slab = self._slices.read(self._workers, z0, z1)
        if isinstance(self._slices.samples, ColourSamples):
            return slab
        with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
            return slab.astype(self._info.stored_type, copy=False)

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x], in the type of the file. Raises the errors of `read_slab`."""
        return self._slices.read(self._workers, z0, z1)


@dataclass(frozen=True)
class _Places:
    """Positions of the slices of a volume."""

    files: list[Path]
    each: NDArray[np.int64]
    """Index of the file, and page, of each slice, [z, 2]."""

    def parts(self, z0: int, z1: int, at_once: int) -> Iterator[tuple[int, Path, tuple[int, ...]]]:
        """Slices z0 to z1 - 1 in parts of one file each: number of the first, file, pages."""
        z = z0
        while z < z1:
            file = self.each[z, 0]
            stop = z + 1
            while stop < min(z1, z + at_once) and self.each[stop, 0] == file:
                stop += 1
            yield z, self.files[file], tuple(self.each[z:stop, 1].tolist())
            z = stop


@dataclass(frozen=True)
class _Slices:
    """Decoding parameters of each slice."""

    places: _Places
    samples: OneSample | ColourSamples
    """Samples to keep."""
    page: TiffPage
    """Properties of all pages."""

    def read(self, pool: Workers, z0: int, z1: int) -> NDArray[np.generic]:
        """Slices in the type of the file, or of a channel of a volume in colour."""
        page = self.page
        slab = np.empty((z1 - z0, page.rows, page.columns), self.samples.dtype(page.dtype))
        parts = list(self.places.parts(z0, z1, pages_at_once(page.rows, page.columns)))

        def place(index: int, values: NDArray[np.generic]) -> None:
            start = parts[index][0] - z0
            slab[start : start + len(values)] = values

        pool.run([decode_request(Pages(file, pages, self.samples, page)) for _, file, pages in parts], place)
        return slab


def channel_names(spec: SourceSpec, path: Path) -> list[str]:
    """Names of the channels of the image that is chosen, "" where they have none. Raises what `open_volume` raises."""
    _, image = _chosen_image(spec, path)
    return _channel_names(image, sizes_of(path, image))


def time_axis(spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the time points of the image that is chosen: when their first planes were taken, or at equal distances.

    Raises VP1220 to VP1225.
    """
    _, image = _chosen_image(spec, path)
    count = sizes_of(path, image).t
    planes = [image.planes.get(str(number), {}) for number in range(count)]
    seconds = [_number(plane, "DeltaT") * (seconds_per(plane.get("DeltaTUnit", "s")) or nan) for plane in planes]
    if all(isfinite(time) for time in seconds) and all(after > before for before, after in pairwise(seconds)):
        return TimeAxis(count, tuple(seconds))
    step = _number(image.pixels, "TimeIncrement")
    return TimeAxis.even(count, step, seconds_per(image.pixels.get("TimeIncrementUnit", "s")))


def _number(attributes: Attributes, name: str) -> float:
    """Return a number of the description, NaN if it is missing."""
    try:
        return float(attributes.get(name, "nan"))
    except ValueError:
        return nan


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> OmeTiffSource:
    """Open the channel, time point and image that are chosen, or the only ones.

    Raises VolprepError VP1220 (not sound), VP1221 and VP1222 (choice), VP1224 (not read), VP1225 (too large), VP1226
    (name of another file), VP1227 (no distances), VP1165 (damaged) or VP1270 to VP1273.
    """
    description, image = _chosen_image(spec, path)
    sizes = sizes_of(path, image)
    channel = 0
    if spec.colour is None:
        channel = chosen(path, "channel", "channel", _channel_names(image, sizes), spec.channel)
    elif sizes.channels != 1:
        raise VolprepError("VP1290", path=path, problem=f"it has {sizes.channels} pictures for each slice")
    time = chosen(path, "volume", "time point", [""] * sizes.t, spec.volume)
    planes, names = planes_of(path, description, image, sizes)
    places = _Places([path.parent / name for name in names], planes[time, channel // sizes.samples])
    if missing := int((places.each[:, 0] < 0).sum()):
        raise VolprepError("VP1220", path=path, error=f"{missing} of the {sizes.z} slices are in no page")
    grid, remarks = grid_of(path, (sizes.z, sizes.y, sizes.x), _spacing_mm_zyx(path, image))
    with workers() as pool:
        page = _common_page(path, places, _expected(path, image, sizes), pool, progress)
        if spec.colour is not None:
            slices = _Slices(places, ColourSamples(spec.colour), page)
            slices.read(pool, 0, 1)
            more = colour_remarks(spec.colour, has_alpha=page.samples == 4, is_linear=page.dtype.startswith("f"))
            info = SourceInfo(format="ome-tiff", grid=grid, stored_type="uint8", remarks=(*remarks, *more))
            return OmeTiffSource(of_colour(info), slices)
        slices = _Slices(places, OneSample(channel % sizes.samples), page)
        stored_type, lost = stored_type_of(page.dtype, sizes.z, lambda z: slices.read(pool, z, z + 1), progress)
        info = SourceInfo(format="ome-tiff", grid=grid, stored_type=stored_type, remarks=(*remarks, *lost))
        return OmeTiffSource(info, slices)


def _chosen_image(spec: SourceSpec, path: Path) -> tuple[Description, Image]:
    description = parse_description(path, description_in(path))
    if description.metadata_file is not None:
        raise VolprepError("VP1224", path=path, what=SafeText("its description, which lies in another file,"))
    images = description.images
    if not images:
        raise VolprepError("VP1220", path=path, error=SafeText("its OME-XML describes no image"))
    return description, images[chosen(path, "series", "image", [image.name for image in images], spec.series)]


def _channel_names(image: Image, sizes: Sizes) -> list[str]:
    names = [channel.get("Name", "") for channel in image.channels][: sizes.channels]
    names += [""] * (sizes.channels - len(names))
    if sizes.samples == 1:
        return names
    samples = _SAMPLE_NAMES.get(sizes.samples, tuple(str(n) for n in range(1, sizes.samples + 1)))
    return [f"{name} {sample}".strip() for name in names for sample in samples]


def _spacing_mm_zyx(path: Path, image: Image) -> list[float | None]:
    spacing: list[float | None] = []
    for axis in "ZYX":
        text = image.pixels.get(f"PhysicalSize{axis}")
        if text is None:
            spacing.append(None)
            continue
        try:
            length = float(text)
        except ValueError as error:
            raise VolprepError("VP1227", path=path, axis=axis, found=repr(text[:20])) from error
        spacing.append(length * mm_per_unit(path, image.pixels.get(f"PhysicalSize{axis}Unit", _USUAL_UNIT)))
    return spacing


def _expected(path: Path, image: Image, sizes: Sizes) -> tuple[int, int, int, str, int]:
    """Fields of every page."""
    kind = image.pixels.get("Type", "")
    dtype = _DTYPES.get(kind, kind)
    if dtype not in _READ:
        raise VolprepError("VP1224", path=path, what=f"pixels of type {kind[:40]!r}")
    return sizes.y, sizes.x, sizes.samples, dtype, 8 * np.dtype(dtype).itemsize


def _common_page(
    path: Path, places: _Places, expected: tuple[int, int, int, str, int], pool: Workers, progress: Progress
) -> TiffPage:
    """Return the properties of all pages of the volume.

    Raises VP1220 if a page is missing or disagrees with the OME-XML.
    """
    used = sorted(set(places.each[:, 0].tolist()))
    for file in (places.files[index] for index in used):
        if not is_there(file):
            raise VolprepError("VP1220", path=path, error=f"slices of it are in {file.name}, which is missing")
    progress.start("reading page headers", len(used))
    found: dict[int, tuple[TiffPage, ...]] = {}
    page: TiffPage | None = None

    def take(index: int, answer: NDArray[np.generic]) -> None:
        found[used[index]] = pages_of(answer)
        progress.advance()

    pool.run([pages_request(places.files[index]) for index in used], take)
    for file_index, page_index in places.each.tolist():
        file, pages = places.files[file_index], found[file_index]
        if page_index >= len(pages):
            raise VolprepError("VP1220", path=file, error=f"it has {len(pages)} pages, and no page {page_index}")
        page = pages[page_index]
        if (page.rows, page.columns, page.samples, page.dtype, page.bits) != expected:
            rows, columns, samples, dtype, bits = expected
            says = f"{columns}×{rows} pixels of {samples} {bits}-bit {dtype}"
            error = f"page {page_index} has {page}, but the OME-XML says {says}"
            raise VolprepError("VP1220", path=file, error=error)
    assert page is not None  # noqa: S101 - a volume has at least one slice
    return page
