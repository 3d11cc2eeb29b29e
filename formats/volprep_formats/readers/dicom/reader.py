"""DICOM series as one volume: single images, multi-frame images and mosaics.

Stored values are kept where all slices share one rescale; slices with rescales of their own become physical float32.
MONOCHROME1 says how a picture is shown, not what its values mean: values with a unit are kept, values without one are
turned round (lowest + highest - v over the stored bits), so that large is bright, as viewers show it.
"""

import os
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import colour_remarks, of_colour
from volprep_formats.readers.dicom import frame_times
from volprep_formats.readers.dicom.geometry import Stack, stack_images
from volprep_formats.readers.dicom.header import EncodedPixels, SliceImage, ValueTable
from volprep_formats.readers.dicom.pixels import (
    check_decodable,
    decode_native,
    is_as_stored,
    is_compressed,
    read_native,
    slice_of,
    stored_range,
)
from volprep_formats.readers.dicom.scan import Scan, Series, choose_series, scan
from volprep_formats.readers.dicom.uptake import Uptake, uptake_of
from volprep_formats.readers.dicom.value_table import looked_up, table_range
from volprep_formats.readers.grey import grey_remark
from volprep_formats.source import ColourChannel, GreyOf, RepairKind, SourceInfo, SourceSpec, StoredType
from volprep_formats.uneven_source import SlicePlaces, UnevenSource

if TYPE_CHECKING:
    from volprep_formats.isolation import Workers

_FLOAT32_BITS = 24
_ABOVE = (
    "some pixels have bits above BitsStored, which the standard leaves to other uses; they were left out, so values "
    "that were meant to be larger are wrong"
)


time_axis = frame_times.time_axis


@dataclass(frozen=True)
class _Slice:
    """Conversion of a decoded slice to volume values: (v, or mirror - v) · slope + intercept, v being decoded.

    With a table, v is the table's entry for the decoded value.
    """

    pixels: EncodedPixels
    table: ValueTable | None
    mirror: int | None
    slope: float
    intercept: float

    def is_plain(self, dtype: np.dtype[np.generic]) -> bool:
        """Whether its values are in the file as the volume wants them, which is of type `dtype`."""
        unchanged = self.mirror is None and (self.slope, self.intercept) == (1.0, 0.0) and self.pixels.tile is None
        return unchanged and self.table is None and is_as_stored(self.pixels, dtype)


class DicomSource(OpenedSource):
    """One series, decoded slab by slab."""

    def __init__(self, info: SourceInfo, slices: Sequence[_Slice]) -> None:
        super().__init__(info)
        self._slices = tuple(slices)
        self._cores = os.cpu_count() or 1
        self._pool: ThreadPoolExecutor | None = None
        self._workers: Workers | None = None
        self._above = Event()

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and photometry; after reading also remarks on the pixels."""
        if not self._above.is_set():
            return self._info
        return self._info.model_copy(update={"remarks": (*self._info.remarks, _ABOVE)})

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], decoded on all cores, compressed ones in worker processes.

        Raises VolprepError VP1003, VP1031, VP1039, VP1040 or VP1046 to VP1049 when a file is damaged, VP1270 to VP1273
        when its decoder goes wrong.
        """
        wanted = self._slices[0].pixels.grey
        dtype = wanted.dtype if isinstance(wanted, ColourChannel) else self._info.stored_type
        slab = np.empty((z1 - z0, *self._info.grid.shape_zyx[1:]), dtype)
        plain = [z for z in range(z0, z1) if self._slices[z].is_plain(slab.dtype)]

        def read_part(first: int) -> None:
            for z in plain[first :: self._cores]:
                if read_native(self._slices[z].pixels, slab[z - z0]):
                    self._above.set()

        # All slices of one mosaic come from one decoded picture.
        pictures: dict[EncodedPixels, list[int]] = {}
        for z in sorted({*range(z0, z1)}.difference(plain)):
            pictures.setdefault(replace(self._slices[z].pixels, tile=None), []).append(z)

        def place(picture: EncodedPixels, decoded: NDArray[np.generic]) -> None:
            for z in pictures[picture]:
                _convert(self._slices[z], decoded, slab[z - z0])

        def decode(picture: EncodedPixels) -> None:
            decoded, above = decode_native(picture)
            if above:
                self._above.set()
            place(picture, decoded)

        native = [picture for picture in pictures if not is_compressed(picture)]
        self._pool = self._pool or self._opened.enter_context(ThreadPoolExecutor(self._cores))
        # A task for each core, not for each slice: to hand one over takes as long as to read a small slice.
        for _ in self._pool.map(read_part, range(self._cores)):
            pass
        for _ in self._pool.map(decode, native):
            pass
        compressed = [picture for picture in pictures if is_compressed(picture)]
        if compressed:
            from volprep_formats.isolation import workers  # noqa: PLC0415 - seldom needed
            from volprep_formats.readers.dicom.compressed import decode_request  # noqa: PLC0415 - heavy

            self._workers = self._workers or self._opened.enter_context(workers())
            requests = [decode_request(picture) for picture in compressed]
            self._workers.run(requests, lambda index, decoded: place(compressed[index], decoded))
        return slab

    def __exit__(self, *exception: object) -> None:
        """Stop the threads, and the workers unless they have other users. Files are not open between slabs."""
        self._pool = self._workers = None
        super().__exit__(*exception)


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> DicomSource:
    """Open the series that `spec` means in the folder tree, or file, `path`.

    Raises VolprepError VP1003, VP1030 to VP1052 (files and pixels) and VP2001 to VP2015 (geometry).
    """
    return _open(spec, path, progress, repair=())[0]


def open_slices(spec: SourceSpec, path: Path, progress: Progress) -> DicomSource | UnevenSource:
    """Open a series as `open_volume` does, or its slices as they lie where they form no grid and `spec.repair` fits."""
    source, places = _open(spec, path, progress, repair=spec.repair)
    return source if places is None else UnevenSource(source, places)


def _open(
    spec: SourceSpec, path: Path, progress: Progress, repair: Collection[RepairKind]
) -> tuple[DicomSource, SlicePlaces | None]:
    scanned = scan(path, progress)
    series = choose_series(scanned, spec)
    wanted = spec.colour or spec.rgb
    readable = series if wanted is None else _with_colours(series, wanted)
    stack = stack_series(readable, repair, spec.volume, by_number=spec.volumes_by == "number")
    images = [readable.images[i] for i in stack.order]
    pixels = [image.pixels for image in images if image.pixels is not None]
    first = images[0]
    one_rescale = len({(image.slope, image.intercept) for image in images}) == 1
    uptake = uptake_of(images) if spec.suv else Uptake(1.0, first.unit, "")
    if spec.colour is not None:
        remarks = (*stack.remarks, *_remarks(images, one_rescale=True), *_left_out(scanned, series))
        info = SourceInfo(
            format="dicom", grid=stack.grid, stored_type="uint8", modality=first.modality, remarks=remarks
        )
        return DicomSource(of_colour(info), [_Slice(pixel, None, None, 1.0, 0.0) for pixel in pixels]), stack.places
    info = SourceInfo(
        format="dicom",
        grid=stack.grid,
        stored_type=_stored_type(images) if one_rescale else "float32",
        slope=first.slope * uptake.factor if one_rescale else 1.0,
        intercept=first.intercept * uptake.factor if one_rescale else 0.0,
        unit=uptake.unit,
        modality=first.modality,
        remarks=(
            *stack.remarks,
            *_remarks(images, one_rescale=one_rescale),
            *_left_out(scanned, series),
            *((uptake.remark,) if uptake.remark else ()),
        ),
    )
    slices = [
        _Slice(
            pixels=encoded,
            table=image.table,
            mirror=sum(_range(image, encoded)) if _is_turned(encoded, first.unit) else None,
            slope=1.0 if one_rescale else image.slope * uptake.factor,
            intercept=0.0 if one_rescale else image.intercept * uptake.factor,
        )
        for image, encoded in zip(images, pixels, strict=True)
    ]
    return DicomSource(info, slices), stack.places


def stack_series(
    series: Series, repair: Collection[RepairKind] = (), volume: int | None = None, *, by_number: bool = False
) -> Stack:
    """Order the slices of a series and find their grid. Raises an error for an invalid series, before any decoding."""
    for image in series.images:
        if image.problem is not None:
            raise image.problem
    _check_frame_of_reference(series.images)
    stack = stack_images(series.images, repair, volume, by_number=by_number)
    for image in series.images:
        if image.pixels is not None:
            check_decodable(image.pixels)
    return stack


def _check_frame_of_reference(images: Sequence[SliceImage]) -> None:
    """Refuse slices whose positions refer to different coordinate systems; a slice may name none."""
    firsts: dict[str, SliceImage] = {}
    for image in images:
        if image.frame_of_reference:
            firsts.setdefault(image.frame_of_reference, image)
    if len(firsts) > 1:
        one, other, *_ = (image.path for image in firsts.values())
        folder = os.path.commonpath((one.parent, other.parent))
        first, second = os.path.relpath(one, folder), os.path.relpath(other, folder)
        raise VolprepError("VP1051", folder=folder, count=len(firsts), first=first, other=second)


def _with_colours(series: Series, grey: GreyOf | ColourChannel) -> Series:
    """Return the same series without problems about colours that can be converted to grey, or kept.

    Raises VP1290 for pictures without colours, or with some that are not read, where they are to be kept.
    """
    images = []
    for image in series.images:
        if image.pixels is None or not image.pixels.colours:
            if isinstance(grey, ColourChannel):
                _check_no_other_problem(image)
            images.append(image)
            continue
        if isinstance(grey, ColourChannel) and (image.slope, image.intercept) != (1.0, 0.0):
            raise VolprepError("VP1290", path=image.path, problem=SafeText("its colours are rescaled (RescaleSlope)"))
        forgiven = image.problem is not None and image.problem.code == "VP1035"
        pixels = replace(image.pixels, grey=grey)
        images.append(replace(image, pixels=pixels, problem=None if forgiven else image.problem))
    return replace(series, images=tuple(images))


def _check_no_other_problem(image: SliceImage) -> None:
    """Raise VP1290 for a picture without colours that can be kept, unless something else is wrong with it."""
    if image.problem is None:
        raise VolprepError("VP1290", path=image.path, problem=SafeText("its pixels are grey"))
    if image.problem.code == "VP1035":
        problem = f"its colours ({image.problem.fields['kind']}, or their compression) are not read"
        raise VolprepError("VP1290", path=image.path, problem=problem)


def _convert(source: _Slice, picture: NDArray[np.generic], target: NDArray[np.generic]) -> None:
    """Put one slice of a decoded picture into its place in a slab."""
    values = slice_of(source.pixels, picture)
    if source.table is not None:
        values = looked_up(source.table, values)
    if source.mirror is not None:
        values = source.mirror - values.astype(np.int64)
    if (source.slope, source.intercept) != (1.0, 0.0):
        values = values.astype(np.float64) * source.slope + source.intercept
    with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
        target[...] = values


def _range(image: SliceImage, pixels: EncodedPixels) -> tuple[int, int]:
    """Lowest and highest value that a slice can have, before its rescale."""
    return stored_range(pixels) if image.table is None else table_range(image.table)


def _stored_type(images: Sequence[SliceImage]) -> StoredType:
    """Smallest type that holds the values of all slices, before their rescale."""
    if any(image.pixels is not None and image.pixels.is_float for image in images):
        return "float32"
    ranges = [_range(image, image.pixels) for image in images if image.pixels is not None]
    low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
    kinds: tuple[StoredType, ...] = ("uint8", "int16", "uint16")
    for kind in kinds:
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return kind
    return "float32"


def _is_turned(pixels: EncodedPixels, unit: str) -> bool:
    # Floating-point pixels are measurements (parametric maps), with or without a unit.
    return pixels.inverted and not unit and not pixels.is_float


def _remarks(images: Sequence[SliceImage], *, one_rescale: bool) -> list[str]:
    remarks = []
    if not one_rescale:
        remarks.append("slope and intercept differ from slice to slice; the values are physical ones, as float32")
    pixels = [image.pixels for image in images if image.pixels is not None]
    if any(p.inverted for p in pixels):
        turned = any(_is_turned(p, images[0].unit) for p in pixels)
        remarks.append(
            "MONOCHROME1: the values were turned round, so that large is bright"
            if turned
            else "MONOCHROME1: low values are meant to be shown bright; the values are kept, because they are in "
            + (images[0].unit or "floating point")
        )
    if any(image.table is not None for image in images):
        remarks.append("the values come from the table in the header (ModalityLUTSequence), not from the pixels alone")
    told = (
        (
            any(image.modality == "RTDOSE" and not image.unit for image in images),
            "the dose has no unit or no scaling (DoseUnits, DoseGridScaling): its values are not in gray",
        ),
        (
            any(image.is_in_volume for image in images),
            "the frames lie in a volume of their own (ImagePositionVolume), whose place in the patient is not known",
        ),
        (
            any(image.has_real_world_values for image in images),
            "the header also maps its values to real-world ones (RealWorldValueMappingSequence), which is not applied",
        ),
    )
    remarks += [text for is_so, text in told if is_so]
    if any(not p.is_float and p.high_bit != p.bits_stored - 1 for p in pixels):
        remarks.append("HighBit is not BitsStored - 1: the stored bits were moved down, and those below them dropped")
    remarks += _of_colours(pixels)
    if any(not p.is_float and p.bits_stored > _FLOAT32_BITS for p in pixels):
        remarks.append("integers of more than 24 bits are read as 32-bit floating point; those beyond 2^24 are rounded")
    if any(p.is_float and p.bits_allocated > 32 for p in pixels):
        remarks.append("64-bit floating-point pixels are read as 32-bit ones")
    if len({image.unit for image in images}) > 1 or len({image.modality for image in images}) > 1:
        remarks.append("unit or modality differ from slice to slice; the first slice's are used")
    if any(image.has_padding for image in images):
        remarks.append("the series has a padding value for pixels outside the scanned field; it is kept as a value")
    if any(image.has_burned_in_text for image in images):
        remarks.append("warning: the series says that text is burned into its pixels; it may name the patient")
    return remarks


def _of_colours(pixels: Sequence[EncodedPixels]) -> list[str]:
    """Return the remark about what became of colours, if there are any."""
    wanted = next((pixel.grey for pixel in pixels if pixel.colours), None)
    if isinstance(wanted, ColourChannel):
        return colour_remarks(wanted, has_alpha=False, is_linear=False)
    return [] if wanted is None else [grey_remark(wanted)]


def _missing(series: Series) -> list[str]:
    """Return remarks on missing images of the acquisition and missing parts of a concatenation."""
    remarks = []
    wanted = max((image.acquired or 0 for image in series.images), default=0)
    if wanted > len(series.images):
        remarks.append(f"the header says {wanted} images (ImagesInAcquisition), and {len(series.images)} are here")
    parts = {image.part for image in series.images if image.part is not None}
    total = max((part[1] for part in parts), default=0)
    if total > len(parts):
        there = ", ".join(str(number) for number, _ in sorted(parts))
        remarks.append(f"the series is part {there} of {total} of a concatenation: the other parts are not here")
    return remarks


def _left_out(scanned: Scan, chosen: Series) -> list[str]:
    remarks = _missing(chosen)
    if any(image.is_localiser for image in chosen.images):
        remarks.append(f"this is a localiser (scout) of {len(chosen.images)} slice(s), not a scan of a volume")
    others = [series for series in scanned.series if series is not chosen]
    if others:
        images = sum(len(series.images) for series in others)
        remarks.append(f"other series in the folder were left out: {len(others)}, with {images} images")
    if chosen.copies:
        remarks.append(f"images that are copies of others of the series were left out: {chosen.copies}")
    if scanned.damaged:
        remarks.append(f"files without a DICOM header, whose names say DICOM, were left out: {len(scanned.damaged)}")
    if scanned.other_files:
        remarks.append(f"other files in the folder were left out: {scanned.other_files}")
    return remarks
