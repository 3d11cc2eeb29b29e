"""DICOM series of single-frame images as one volume.

Stored values are kept where all slices share one rescale; slices with rescales of their own become physical float32.
MONOCHROME1 says how a picture is shown, not what its values mean: values with a unit are kept, values without one are
turned round (lowest + highest - v over the stored bits), so that large is bright, as viewers show it.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep_formats.progress import Progress
from volprep_formats.readers.dicom_file import quiet_pydicom
from volprep_formats.readers.dicom_geometry import stack_images
from volprep_formats.readers.dicom_header import EncodedPixels, ImageFile
from volprep_formats.readers.dicom_pixels import check_decodable, decode_slice, stored_range
from volprep_formats.readers.dicom_scan import Scan, Series, choose_series, scan
from volprep_formats.source import SourceInfo, SourceSpec, StoredType


@dataclass(frozen=True)
class _Slice:
    """How one slice becomes values of the volume: (decoded, or mirror - decoded) · slope + intercept."""

    pixels: EncodedPixels
    mirror: int | None
    slope: float
    intercept: float


class DicomSource:
    """One series, decoded slab by slab."""

    def __init__(self, info: SourceInfo, slices: Sequence[_Slice]) -> None:
        self._info = info
        self._slices = tuple(slices)

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry."""
        return self._info

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], decoded on all cores.

        Raises VolprepError VP1003, VP1031 or VP1039 when a file is damaged.
        """
        slab = np.empty((z1 - z0, *self._info.grid.shape_zyx[1:]), dtype=self._info.stored_type)

        def fill(z: int) -> None:
            _convert(self._slices[z0 + z], slab[z])

        with quiet_pydicom(), ThreadPoolExecutor(os.cpu_count()) as pool:
            for _ in pool.map(fill, range(z1 - z0)):
                pass
        return slab

    def __enter__(self) -> Self:
        """Give the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Nothing stays open between slabs."""


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> DicomSource:
    """Open the series that `spec` means in the folder tree, or file, `path`.

    Raises VolprepError VP1003, VP1030 to VP1044 (files and pixels) and VP2001 to VP2015 (geometry).
    """
    scanned = scan(path, progress)
    series = choose_series(scanned, spec.series)
    for image in series.images:
        if image.problem is not None:
            raise image.problem
    stack = stack_images(series.images)
    images = [series.images[i] for i in stack.order]
    pixels = [image.pixels for image in images if image.pixels is not None]
    with quiet_pydicom():
        for encoded in pixels:
            check_decodable(encoded)
    first = images[0]
    one_rescale = len({(image.slope, image.intercept) for image in images}) == 1
    info = SourceInfo(
        format="dicom",
        grid=stack.grid,
        stored_type=_stored_type(pixels) if one_rescale else "float32",
        slope=first.slope if one_rescale else 1.0,
        intercept=first.intercept if one_rescale else 0.0,
        unit=first.unit,
        modality=first.modality,
        remarks=(*stack.remarks, *_remarks(images, one_rescale=one_rescale), *_left_out(scanned, series)),
    )
    slices = [
        _Slice(
            pixels=encoded,
            mirror=sum(stored_range(encoded)) if encoded.inverted and not first.unit else None,
            slope=1.0 if one_rescale else image.slope,
            intercept=0.0 if one_rescale else image.intercept,
        )
        for image, encoded in zip(images, pixels, strict=True)
    ]
    return DicomSource(info, slices)


def _convert(source: _Slice, target: NDArray[np.generic]) -> None:
    """Decode one slice into its place in a slab."""
    values = decode_slice(source.pixels)
    if source.mirror is not None:
        values = source.mirror - values.astype(np.int32)
    if (source.slope, source.intercept) != (1.0, 0.0):
        values = values.astype(np.float64) * source.slope + source.intercept
    target[...] = values


def _stored_type(pixels: Sequence[EncodedPixels]) -> StoredType:
    """Smallest type that holds the stored bits of all slices."""
    ranges = [stored_range(p) for p in pixels]
    low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
    kinds: tuple[StoredType, ...] = ("uint8", "int16", "uint16")
    for kind in kinds:
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return kind
    return "float32"


def _remarks(images: Sequence[ImageFile], *, one_rescale: bool) -> list[str]:
    remarks = []
    if not one_rescale:
        remarks.append("slope and intercept differ from slice to slice; the values are physical ones, as float32")
    if any(image.pixels is not None and image.pixels.inverted for image in images):
        unit = images[0].unit
        remarks.append(
            f"MONOCHROME1: low values are meant to be shown bright; the values are kept, because they are in {unit}"
            if unit
            else "MONOCHROME1: the values were turned round, so that large is bright"
        )
    if len({image.unit for image in images}) > 1 or len({image.modality for image in images}) > 1:
        remarks.append("unit or modality differ from slice to slice; those of the first slice are used")
    if any(image.has_padding for image in images):
        remarks.append("the series has a padding value for pixels outside the scanned field; it is kept as a value")
    if any(image.has_burned_in_text for image in images):
        remarks.append("the series says that text is burned into its pixels; it may name the patient")
    return remarks


def _left_out(scanned: Scan, chosen: Series) -> list[str]:
    remarks = []
    others = [series for series in scanned.series if series is not chosen]
    if others:
        images = sum(len(series.images) for series in others)
        remarks.append(f"other series in the folder were left out: {len(others)}, with {images} images")
    if scanned.other_files:
        remarks.append(f"other files in the folder were left out: {scanned.other_files}")
    return remarks
