"""OME-Zarr: one channel at one time point of one level of an image, in a folder or a zip, Zarr 2 or 3.

Metadata and chunks are read by worker processes, which keep within the store. A chunk that is missing holds the fill
value, as the format says; but it may as well have been lost, so missing ones are counted.
"""

import json
import math
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.installation import require_extra
from volprep_formats.isolation import WorkerRequest, Workers, workers
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import channel_of_colours, colour_remarks, of_colour
from volprep_formats.readers.colour_voxels import voxel_type
from volprep_formats.readers.decoded_source import DecodedSource
from volprep_formats.readers.ome.channels import chosen, grid_of
from volprep_formats.readers.ome.ngff import NgffImage, ResolutionLevel, picture_of, series_of
from volprep_formats.readers.ome.zarr_array import (
    ArrayFacts,
    ArrayRequest,
    GroupRequest,
    PartRequest,
    Range,
    StoreKey,
    count_request,
    part_request,
    read_facts,
    read_group,
    text_request,
)
from volprep_formats.readers.time_axis import TimeAxis, seconds_per
from volprep_formats.readers.voxel_source import stored_type_of
from volprep_formats.source import ColourChannel, SourceInfo, SourceSpec

_MOST_SERIES, _MOST_CHANNELS, _MOST_TIMES = 1000, 2**16, 2**20
_PART_BYTES, _ROW_BYTES = 2**22, 2**25
_FEW_CHUNKS, _LEAST_CHUNK_VOXELS = 2**12, 2**9
"""More chunks than so few must have voxels enough: each costs its 0.2 ms, however little is in it."""
_MOST_MISSING = 0.25
"""Largest share of missing chunks that is read with a remark. Writers leave out chunks that hold only the fill value,
such as the corners around the scanned region, so some may be missing. If the shape is a third too large, a quarter of
the chunks is missing."""
_RGB = ("ff0000", "00ff00", "0000ff")
_KEPT_BYTES = 2**28
"""Rows of chunks up to this size are decoded once, however thin the slabs are that are asked for."""


@dataclass(frozen=True)
class _Volume:
    """One channel and time point of an array."""

    array: ArrayRequest
    facts: ArrayFacts
    axes: tuple[int, ...]
    """Axis of the array that is z, y and x; without z, y and x alone."""
    fixed: dict[int, int]
    """Index along each of the other axes."""
    components: int | None = None
    """Axis of the array along which the colours of a voxel lie, which come last; None for one value in each voxel."""

    @property
    def tail(self) -> tuple[int, ...]:
        """Shape of the values of a voxel."""
        return () if self.components is None else (self.facts.shape[self.components],)

    @property
    def shape_zyx(self) -> tuple[int, int, int]:
        """Number of voxels."""
        z, y, x = (1, *(self.facts.shape[axis] for axis in self.axes))[-3:]
        return z, y, x

    @property
    def chunk_zyx(self) -> tuple[int, int, int]:
        """Voxels that are decoded together."""
        z, y, x = (1, *(self.facts.chunks[axis] for axis in self.axes))[-3:]
        return z, y, x

    def part(self, *box_zyx: Range) -> PartRequest:
        """Ask for a box, with all components; z is left out where the array has none."""
        ranges = {axis: (index, index + 1) for axis, index in self.fixed.items()}
        ranges |= dict(zip(self.axes, box_zyx[-len(self.axes) :], strict=True))
        axes = self.axes
        if self.components is not None:
            ranges[self.components] = (0, self.tail[0])
            axes = (*axes, self.components)
        return PartRequest(self.array, self.facts, tuple(ranges[axis] for axis in sorted(ranges)), axes)


class _Slabs:
    """Decodes a volume in workers; keeps the last row of chunks."""

    def __init__(self, volume: _Volume, pool: Workers) -> None:
        self._volume = volume
        self._workers = pool
        self._row: tuple[int, NDArray[np.generic]] | None = None

    def read(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Slices in the type of the array."""
        depth, *plane = (*self._volume.shape_zyx, *self._volume.tail)
        slab = np.empty((z1 - z0, *plane), self._volume.facts.dtype)
        slice_bytes = math.prod(plane) * slab.itemsize
        row_bytes = self._volume.chunk_zyx[0] * slice_bytes
        thickness = self._volume.chunk_zyx[0] * max(1, _ROW_BYTES // row_bytes)
        is_kept = min(thickness, depth) * slice_bytes <= _KEPT_BYTES
        for first in range(z0 - z0 % thickness, z1, thickness):
            start, stop = max(z0, first), min(z1, first + thickness)
            target = slab[start - z0 : stop - z0]
            if not is_kept:
                self._decode(start, target)
                continue
            if self._row is None or self._row[0] != first:
                kept = np.empty((min(thickness, depth - first), *plane), slab.dtype)
                self._decode(first, kept)
                self._row = (first, kept)
            target[...] = self._row[1][start - first : stop - first]
        return slab

    def _decode(self, z0: int, target: NDArray[np.generic]) -> None:
        """Fill `target` from slice z0 on, in parts of whole chunks, one or more per core."""
        part_bytes = target.itemsize * math.prod(self._volume.tail)
        starts: list[list[Range]] = []
        for length, chunk in reversed(list(zip(target.shape[:3], self._volume.chunk_zyx, strict=True))):
            step = min(length, chunk)
            step = min(length, step * max(1, _PART_BYTES // (part_bytes * step)))
            part_bytes *= step
            starts.append([(at, min(at + step, length)) for at in range(0, length, step)])
        boxes = list(product(*reversed(starts)))

        def place(index: int, values: NDArray[np.generic]) -> None:
            (a, b), (y0, y1), (x0, x1) = boxes[index]
            target[a:b, y0:y1, x0:x1] = values

        self._workers.run([part_request(self._volume.part((z0 + a, z0 + b), y, x)) for (a, b), y, x in boxes], place)


@dataclass(frozen=True)
class _Colours:
    """A channel of a volume in colour, made of several channels of the file."""

    path: Path
    wanted: ColourChannel
    order: tuple[int, ...]
    """Channels that hold red, green and blue."""
    has_alpha: bool
    """Whether a fourth one holds alpha."""

    def channel(self, slab: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the channel [z, y, x] of components [z, y, x, component]."""
        alpha = slab[..., 3] if self.has_alpha else None
        return channel_of_colours(self.path, self.wanted, slab[..., list(self.order)], alpha)

    def remarks(self, facts: ArrayFacts) -> list[str]:
        """Return the remark about how the colours are read."""
        is_linear = np.dtype(facts.dtype).kind == "f"
        return colour_remarks(self.wanted, has_alpha=self.has_alpha, is_linear=is_linear)


class OmeZarrSource(DecodedSource):
    """Chunks of an array, decoded slab by slab in worker processes."""

    def __init__(self, info: SourceInfo, slabs: _Slabs, colours: _Colours | None = None) -> None:
        super().__init__(info)
        self._slabs = slabs
        self._colours = colours

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x].

        Raises VP1220 (damaged), VP1226, VP1270 to VP1273 and VP1290 (numbers that are no colours).
        """
        if self._colours is not None:
            return self._colours.channel(self._slabs.read(z0, z1))
        with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
            return self._slabs.read(z0, z1).astype(self._info.stored_type, copy=False)

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x], in the type of the file. Raises the errors of `read_slab`."""
        return self._slabs.read(z0, z1)


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> OmeZarrSource:
    """Open the channel, time point, level and image that are chosen, or the only ones; the finest level.

    Raises VolprepError VP1220 (not sound), VP1221 and VP1222 (choice), VP1224 (not read), VP1225 (too large), VP1226
    (leads out of the store), VP1227 (no distance), VP1260 (chunks missing), VP1270 to VP1273, VP1290 (no colours), or
    VP7005 (zarr is not installed).
    """
    require_extra("zarr")
    with workers() as pool:
        store = StoreKey.of(path)
        prefix, picture = _image(path, store, pool, spec.series)
        level = _level(path, picture, spec.level)
        array = ArrayRequest(store, f"{prefix}{level.path}")
        facts = _facts(pool, array)
        if len(facts.shape) != len(picture.axes):
            error = f"its array has {len(facts.shape)} axes, its metadata {len(picture.axes)}"
            raise VolprepError("VP1220", path=path, error=error)
        colours = None if spec.colour is None else _colours_of(path, picture, facts, spec.colour)
        volume = _Volume(
            array, facts, _space_axes(picture), *_fixed(path, picture, facts, spec, in_colour=colours is not None)
        )
        _check_chunks(path, volume)
        missing = _check_missing(path, pool, volume, is_accepted=spec.missing == "fill")
        grid, remarks = grid_of(path, volume.shape_zyx, *_lengths_mm_zyx(picture, level))
        remarks += missing
        if level.has_several_scales:
            remarks.append("the level has several scales, where OME-Zarr allows one; they are multiplied")
        if not picture.has_units:
            remarks.append("the file does not say its unit of length; millimetres are assumed")
        slabs = _Slabs(volume, pool)
        if colours is not None:
            colours.channel(slabs.read(0, 1))
            info = SourceInfo(
                format="ome-zarr", grid=grid, stored_type="uint8", remarks=(*remarks, *colours.remarks(facts))
            )
            return OmeZarrSource(of_colour(info), slabs, colours)
        depth = volume.shape_zyx[0]
        stored_type, lost = stored_type_of(facts.dtype, depth, lambda z: slabs.read(z, z + 1), progress)
        info = SourceInfo(format="ome-zarr", grid=grid, stored_type=stored_type, remarks=(*remarks, *lost))
        return OmeZarrSource(info, slabs)


def channel_names(spec: SourceSpec, path: Path) -> list[str]:
    """Names of the channels of the image that is chosen, "" where they have none. Raises what `open_volume` raises."""
    with workers() as pool:
        store = StoreKey.of(path)
        prefix, picture = _image(path, store, pool, spec.series)
        array = ArrayRequest(store, f"{prefix}{picture.levels[0].path}")
        facts = _facts(pool, array)
        return _channels(path, picture, facts)


def time_axis(spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the time points of the image that is chosen. Raises what `open_volume` raises."""
    with workers() as pool:
        store = StoreKey.of(path)
        prefix, picture = _image(path, store, pool, spec.series)
        level = _level(path, picture, spec.level)
        facts = _facts(pool, ArrayRequest(store, f"{prefix}{level.path}"))
    if "t" not in picture.axes:
        return TimeAxis(1)
    axis = picture.axes.index("t")
    return TimeAxis.even(
        _times(path, picture, facts), level.scale[axis], seconds_per(picture.time_unit), level.translation[axis]
    )


def _times(path: Path, picture: NgffImage, facts: ArrayFacts) -> int:
    times = facts.shape[picture.axes.index("t")] if "t" in picture.axes else 1
    if times > _MOST_TIMES:
        raise VolprepError("VP1225", path=path, size=f"{times} time points", limit=str(_MOST_TIMES))
    return times


def _check_chunks(path: Path, volume: _Volume) -> None:
    """Raise VP1225 for a volume in crumbs, which would take hours."""
    count = math.prod(-(-n // m) for n, m in zip(volume.shape_zyx, volume.chunk_zyx, strict=True))
    voxels = math.prod(volume.chunk_zyx)
    if count > _FEW_CHUNKS and voxels < _LEAST_CHUNK_VOXELS:
        limit = f"{_FEW_CHUNKS} chunks of fewer than {_LEAST_CHUNK_VOXELS} voxels"
        raise VolprepError("VP1225", path=path, size=f"{count} chunks of {voxels} voxels", limit=limit)


def _check_missing(path: Path, pool: Workers, volume: _Volume, *, is_accepted: bool) -> list[str]:
    """Raise VP1260 where too many chunks are missing to be the empty ones; remark fewer."""
    counted = _ask(path, pool, count_request(volume.part(*((0, n) for n in volume.shape_zyx))))
    files, missing = counted["files"], counted["missing"]
    if missing > _MOST_MISSING * files and not is_accepted:
        raise VolprepError("VP1260", path=path, missing=missing, files=files, limit=f"{_MOST_MISSING:.0%}")
    return [f"{missing} of {files} chunks are missing and hold the fill value"] if missing else []


def _ask(path: Path, pool: Workers, request: WorkerRequest) -> Any:
    try:
        return json.loads(pool.result_of(request).tobytes())
    except RecursionError as error:  # what the worker could read may be too deep here, where more calls are open
        raise VolprepError("VP1220", path=path, error=SafeText("its metadata nest too deeply")) from error


def _facts(pool: Workers, array: ArrayRequest) -> ArrayFacts:
    told = _ask(array.store.path, pool, text_request(read_facts, array))
    return ArrayFacts(tuple(told["shape"]), tuple(told["chunks"]), told["dtype"])


def _image(path: Path, store: StoreKey, pool: Workers, wanted: str | None) -> tuple[str, NgffImage]:
    """Location of the image's group, with a slash at its end, and its attributes."""
    attributes = _ask(path, pool, text_request(read_group, GroupRequest(store, ""))) or {}
    picture = picture_of(path, attributes)
    if picture is not None:
        if wanted is not None:
            chosen(path, "series", "image", [""], wanted)
        return "", picture
    if not series_of(attributes):
        raise VolprepError(
            "VP1220", path=path, error=SafeText("it has no multiscales, which make a Zarr store an image")
        )
    pictures: list[NgffImage] = []
    while len(pictures) < _MOST_SERIES:
        attributes = _ask(path, pool, text_request(read_group, GroupRequest(store, str(len(pictures)))))
        found = None if attributes is None else picture_of(path, attributes)
        if found is None:
            break
        pictures.append(found)
    index = chosen(path, "series", "image", [""] * len(pictures), wanted)
    return f"{index}/", pictures[index]


def _level(path: Path, picture: NgffImage, wanted: int | None) -> ResolutionLevel:
    index = 0 if wanted is None else wanted
    if index >= len(picture.levels):
        found = f" 0 (the finest) to {len(picture.levels) - 1}"
        raise VolprepError("VP1222", path=path, kind="level", wanted=index, key="level", found=found)
    return picture.levels[index]


def _space_axes(picture: NgffImage) -> tuple[int, ...]:
    return tuple(picture.axes.index(axis) for axis in "zyx" if axis in picture.axes)


def _channels(path: Path, picture: NgffImage, facts: ArrayFacts) -> list[str]:
    count = facts.shape[picture.axes.index("c")] if "c" in picture.axes else 1
    if count > _MOST_CHANNELS:
        raise VolprepError("VP1225", path=path, size=f"{count} channels", limit=str(_MOST_CHANNELS))
    names = list(picture.channels[:count])
    return names + [""] * (count - len(names))


def _colours_of(path: Path, picture: NgffImage, facts: ArrayFacts, wanted: ColourChannel) -> _Colours:
    """Find red, green, blue and alpha among the channels.

    Raises VP1290 where there are not 3 or 4, or where they are shown in other colours.
    """
    count = len(_channels(path, picture, facts))
    voxel_type(path, np.dtype(facts.dtype), count)
    shown_in = picture.shown_in[:3]
    if not any(shown_in):
        return _Colours(path, wanted, (0, 1, 2), has_alpha=count == 4)
    if sorted(shown_in) != sorted(_RGB):
        found = ", ".join(f"#{value[:6]}" for value in shown_in)
        raise VolprepError(
            "VP1290", path=path, problem=f"its channels are shown in {found}, not in red, green and blue"
        )
    return _Colours(path, wanted, tuple(shown_in.index(name) for name in _RGB), has_alpha=count == 4)


def _fixed(
    path: Path, picture: NgffImage, facts: ArrayFacts, spec: SourceSpec, *, in_colour: bool
) -> tuple[dict[int, int], int | None]:
    """Index along the axes of channels and time points; and the axis of colours, if they are all wanted."""
    channel = None
    if not in_colour:
        channel = chosen(path, "channel", "channel", _channels(path, picture, facts), spec.channel)
    time = chosen(path, "volume", "time point", [""] * _times(path, picture, facts), spec.volume)
    wanted = {"t": time} if channel is None else {"c": channel, "t": time}
    fixed = {axis: wanted[name] for axis, name in enumerate(picture.axes) if name in wanted}
    return fixed, picture.axes.index("c") if in_colour else None


def _lengths_mm_zyx(picture: NgffImage, level: ResolutionLevel) -> tuple[list[float | None], list[float]]:
    """Spacing, None for an absent axis, and position of the first voxel."""
    spacing: list[float | None] = []
    origin: list[float] = []
    for name in "zyx":
        axis = picture.axes.index(name) if name in picture.axes else None
        spacing.append(None if axis is None else level.scale[axis] * picture.mm_per_unit[axis])
        origin.append(0.0 if axis is None else level.translation[axis] * picture.mm_per_unit[axis])
    return spacing, origin
