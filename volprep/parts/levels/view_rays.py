"""Rays of pictures through a whole scan, from all sides and some oblique views, aimed at visible blocks.

A step keeps its promise if it does in the worst view, and one view may show little but the part of a scan that has the
finest detail. On a shell from micro-CT rays through patches were off by 0.0021, the views from above by 0.0048, and
these rays by 0.0047; over six scans the worst of 17 pictures had 0.6 to 1.3 times their error, and up to 2.5 times
the error of rays through patches.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.headlight import Shown, headlight
from volprep.parts.levels.label_rays import LabelLooks
from volprep.parts.levels.rays import RaySegments, inside_box, sample_level
from volprep.parts.levels.small_segments import SegmentBoxes
from volprep.parts.programs.patch_rays import FINE, PatchRays
from volprep.plan.records import CropPlan
from volprep.scan.in_memory import InMemory
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import MEASURED_BLOCK, Measured
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, HalvedAxes
from volprep_formats.source import SourceInfo

_OBLIQUE = 10
"""Views in addition to the six sides; their directions are spread evenly over the sphere."""
_MOST_RAYS, _FEWEST_RAYS = 150, 30
"""Of a view."""
PER_VOXEL = 2 * FINE
"""Samples for each of the smallest edges of a voxel: with half of them the truth is so smooth that the finest steps
seem worse than they are. On thin vessels an eighth of a voxel was off by 0.0033 instead of 0.0008."""
FINER_PER_VOXEL = 64
"""The same to check a step that is hardly longer than these samples, if they are lit. With 16, 32 and 64 samples an
eighth of a voxel was off by 0.0014, 0.0019 and 0.0021 on the engine, and by 0.0026 in the worst of 17 pictures."""
_SAMPLES = 3_000_000
"""Of all rays together, about."""
_BESIDE = 6
"""Rays beside a ray that the gradients of its samples need."""
_MOST_VOXELS = 256
"""Length of a ray at most: longer ones see nothing else, and cost more."""
_LENGTHS = 3
"""Lengths of the rays of an oblique view."""
_PICKED = 30
"""Places that are picked for each ray, so that rays meet all that a view shows with even chance."""
_SEED = 23


@dataclass(frozen=True)
class Headlit:
    """How samples are lit by the viewer."""

    shown: Shown
    """Their visible samples."""
    soft_per_mm: float
    """Slope of a place that counts half as a surface, in the codes' own unit."""
    halved_zyx: HalvedAxes = (False, False, False)
    """Axes along which differences are of values half a voxel to each side."""
    border_per_mm: float = 1.0
    """Weight of the slope of a border of segments beside a slope of codes, both per millimetre."""


@dataclass(frozen=True)
class ViewGroup:
    """Rays of one view that are equally long."""

    view: int
    """Number of the view."""
    lines: RaySegments
    """The rays."""
    weights: Float64Array | None = None
    """[ray]: weight of each in a mean, if they differ."""


def view_rays(  # noqa: PLR0917 - the parts of a channel's scan
    volume: RawVolume,
    info: SourceInfo,
    measured: Measured,
    seen: NDArray[np.bool_],
    crop: CropPlan,
    grid: Grid,
    *,
    lit: Sequence[Table] | None = None,
    labelled: LabelLooks | None = None,
    soft_slope: float = SOFT_SLOPE,
    per_voxel: int = PER_VOXEL,
) -> list[PatchRays]:
    """Return the physical values along rays through the part of a source that is level 0, whose grid is `grid`.

    `seen` says in which of the measured blocks [z, y, x] a transfer function shows something. Returns no rays if no
    block does. Where samples are lit, `lit` are the transfer functions: what all show is lit, all of it for none. Of
    segments, `labelled` are the labels of the source; small ones have more rays.
    """
    spacing_mm_xyz = np.array(grid.spacing_mm_zyx[::-1])
    offset_mm = np.array(crop.start_zyx[::-1]) * spacing_mm_xyz
    block_mm = spacing_mm_xyz * MEASURED_BLOCK
    corners_mm = np.argwhere(seen)[:, ::-1] * block_mm - offset_mm
    boxes = SegmentBoxes.of(() if labelled is None else labelled.boxes, grid, crop.start_zyx)
    shifted = [
        replace(group, lines=replace(group.lines, starts_mm_xyz=group.lines.starts_mm_xyz + offset_mm))
        for group in _groups(grid, corners_mm, block_mm, boxes, lit=lit is not None)
    ]
    lowest, highest = measured.statistics.minimum, measured.statistics.maximum
    codes, window = _codes(volume, info, (lowest, highest))
    # The soft slope counts in parts of the values that a package holds; codes of 16 bits may be much wider.
    share = (highest - lowest) / abs(window[1] - window[0]) if highest > lowest else 1.0
    soft_per_mm = share * soft_slope / min(grid.spacing_mm_zyx)
    light = None if lit is None else Headlit(Shown(lit, window), soft_per_mm, border_per_mm=share)
    return sampled(codes, grid.spacing_mm_zyx, shifted, window, light, per_voxel, labelled)


def sampled(  # noqa: PLR0917 - where, what, and how fine
    codes: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    groups: Sequence[ViewGroup],
    window: tuple[float, float],
    lit: Headlit | None,
    per_voxel: int = FINE,
    labelled: LabelLooks | None = None,
) -> list[PatchRays]:
    """Sample a volume of codes along groups of rays; `window` are the physical values of its codes 0 and the largest.

    `lit` says which samples are lit, and how; None if none is. `labelled` are the labels of segments.
    """
    if not groups:
        return []
    lines = RaySegments.joined([group.lines for group in groups])
    samples = sample_level(codes, spacing_mm_zyx, lines, per_voxel=per_voxel)
    low, high = window
    values = low + samples.values.astype(np.float64) * samples.scale * (high - low)
    shown = None
    if lit is not None:
        wanted = lit.shown.samples(samples, per_voxel)
        borders = None
        if labelled is not None and lit.shown.tables:
            borders = labelled.border_slopes(spacing_mm_zyx, lit.shown.tables, values, lit.border_per_mm)
        shown = headlight(
            codes, spacing_mm_zyx, lines, samples, wanted, lit.soft_per_mm, halved_zyx=lit.halved_zyx, borders=borders
        )
    looks = None if labelled is None else labelled.along(spacing_mm_zyx, lines, np.diff(samples.offsets))
    views = 1 + max(group.view for group in groups)
    rays: list[PatchRays] = []
    begin = 0
    for group in groups:
        count = len(group.lines.lengths_mm)
        first, end = (int(samples.offsets[ray]) for ray in (begin, begin + count))
        step_mm = float(group.lines.lengths_mm[0]) * count / (end - first)
        light = None if shown is None else _by_ray(shown[first:end], count)
        own = tuple(slice(0, count if number == group.view else 0) for number in range(views))
        of_labels = None if looks is None else _looks_by_ray(looks[:, first:end], count)
        rays.append(PatchRays(_by_ray(values[first:end], count), step_mm, own, light, of_labels, group.weights))
        begin += count
    return rays


def cut(lines: RaySegments, length_mm: float, seed: int) -> RaySegments:
    """Return pieces of this length, begun where chance says; shorter rays are dropped."""
    kept = np.flatnonzero(lines.lengths_mm >= length_mm)
    longer = lines.taken(kept)
    share = np.random.default_rng(seed).random(len(kept))
    aside_mm = share * (longer.lengths_mm - length_mm)
    # A third begins where rays enter the box, as the rays of pictures do.
    aside_mm[::3] = 0.0
    starts = longer.starts_mm_xyz + aside_mm[:, None] * longer.directions_xyz
    return RaySegments(starts, longer.directions_xyz, np.full(len(kept), math.nextafter(length_mm, 0.0)))


def _groups(
    grid: Grid, corners_mm: Float64Array, block_mm: Float64Array, boxes: SegmentBoxes, *, lit: bool
) -> Iterator[ViewGroup]:
    """Yield the rays of all views, grouped by length; views along the axes have more through small `boxes`."""
    if not len(corners_mm):
        return
    directions = _directions()
    voxel_mm = min(grid.spacing_mm_zyx)
    voxels = min(float(np.mean(grid.extent_mm_zyx)) / voxel_mm, float(_MOST_VOXELS))
    of_ray = voxels * PER_VOXEL * (1 + (_BESIDE if lit else 0))
    count = int(np.clip(_SAMPLES / (len(directions) * of_ray), _FEWEST_RAYS, _MOST_RAYS))
    generator = np.random.default_rng(_SEED)
    for view, direction in enumerate(directions):
        lines = picture_lines(grid, corners_mm, block_mm, direction, count, generator)
        # Of oblique rays the shortest tenth, which hardly touch the box, would make all of a group as short.
        order = np.argsort(lines.lengths_mm, kind="stable")[len(lines.lengths_mm) // 10 :]
        if np.count_nonzero(direction) == 1 and len(order):
            axis = int(np.flatnonzero(direction)[0])
            area_mm2 = _seen_area(corners_mm, block_mm, np.array(grid.extent_mm_zyx[::-1]), axis)
            aimed, weights = boxes.aimed_at(lines.taken(order), axis, area_mm2, generator)
            yield ViewGroup(view, begun(aimed, _MOST_VOXELS * voxel_mm), weights)
            continue
        for chosen in np.array_split(order, _LENGTHS):
            if len(chosen):
                yield ViewGroup(view, begun(lines.taken(chosen), _MOST_VOXELS * voxel_mm))


def _seen_area(corners_mm: Float64Array, block_mm: Float64Array, extent_mm_xyz: Float64Array, axis: int) -> float:
    """Return the area that blocks take in a picture along an axis, as far as they are inside the box."""
    sides = np.clip([corners_mm, corners_mm + block_mm], 0.0, extent_mm_xyz)
    columns = np.unique(np.delete(sides, axis, axis=2), axis=1)
    return float((columns[1] - columns[0]).prod(axis=1).sum())


def begun(lines: RaySegments, most_mm: float) -> RaySegments:
    """Return pieces of rays that are as long as the shortest, from where they enter the box.

    A piece that begins inside is cut open as no picture is: on a shell such pieces had 1.6 times the error of pictures.
    """
    length_mm = float(lines.lengths_mm[0]) * (1.0 - 1e-9)
    if length_mm > most_mm:
        return cut(lines, most_mm, _SEED)
    return replace(lines, lengths_mm=np.full(len(lines.lengths_mm), length_mm))


def picture_lines(  # noqa: PLR0917 - where, whither, and how many
    grid: Grid,
    corners_mm: Float64Array,
    block_mm: Float64Array,
    direction: Float64Array,
    count: int,
    generator: np.random.Generator,
) -> RaySegments:
    """Return parallel rays through seen blocks: each place of the picture that shows one is as likely as any other."""
    extent_mm_xyz = np.array(grid.extent_mm_zyx[::-1])
    picked = count * _PICKED
    places_mm = corners_mm[generator.integers(0, len(corners_mm), picked)] + generator.random((picked, 3)) * block_mm
    inside = ((places_mm > 0) & (places_mm < extent_mm_xyz)).all(axis=1)
    places_mm = places_mm[inside]
    if len(places_mm) < count:
        # A volume that is much thinner than a block. On one of 1 × 1 × 40 voxels 8 rays of a view were left, which
        # promised RMSE 0.0017 for a step whose worst picture was 0.0128 off.
        places_mm = _inside(corners_mm, block_mm, extent_mm_xyz, picked, generator)
    if not len(places_mm):
        return RaySegments.none()
    right = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    right /= np.linalg.norm(right)
    aside_mm = np.column_stack([places_mm @ right, places_mm @ np.cross(direction, right)])
    cells = np.floor(aside_mm / (block_mm.min() / 2)).astype(np.int64)
    cells -= cells.min(axis=0)
    cell = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    chance = 1.0 / np.bincount(cell)[cell]
    chosen = generator.choice(len(places_mm), min(count, len(places_mm)), replace=False, p=chance / chance.sum())
    shortest_mm = min(grid.spacing_mm_zyx) * (1.0 - 1e-6)
    return inside_box(places_mm[chosen], np.tile(direction, (len(chosen), 1)), extent_mm_xyz, shortest_mm)


def _inside(
    corners_mm: Float64Array,
    block_mm: Float64Array,
    extent_mm_xyz: Float64Array,
    count: int,
    generator: np.random.Generator,
) -> Float64Array:
    """Return places in the parts of blocks that are inside the box."""
    low, high = np.maximum(corners_mm, 0.0), np.minimum(corners_mm + block_mm, extent_mm_xyz)
    low, high = (value[(high > low).all(axis=1)] for value in (low, high))
    if not len(low):
        return np.empty((0, 3))
    chosen = generator.integers(0, len(low), count)
    places: Float64Array = low[chosen] + generator.random((count, 3)) * (high - low)[chosen]
    return places


def _directions() -> Float64Array:
    """Return the directions of the views [view, xyz]: along the axes both ways, then oblique ones."""
    height = 1.0 - 2.0 * (np.arange(_OBLIQUE) + 0.5) / _OBLIQUE
    angle = np.pi * (1.0 + math.sqrt(5.0)) * (np.arange(_OBLIQUE) + 0.5)
    radius = np.sqrt(1.0 - height**2)
    oblique = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    return np.concatenate([np.eye(3), -np.eye(3), oblique])


def _codes(
    volume: RawVolume, info: SourceInfo, range_of_values: tuple[float, float]
) -> tuple[RawVolume, tuple[float, float]]:
    """Return a volume that rays can be sampled in, and the physical values of its codes 0 and the largest."""
    if volume.dtype.name in {"uint8", "uint16"}:
        largest = 256**volume.dtype.itemsize - 1
        return volume, (info.intercept, info.intercept + info.slope * largest)
    if volume.dtype.name == "int16":
        shifted = _Unsigned(volume.path, volume.shape_zyx, np.dtype(np.uint16), volume)
        return shifted, (info.intercept - 32768 * info.slope, info.intercept + 32767 * info.slope)
    first, last = ((value - info.intercept) / info.slope for value in range_of_values)
    codes = _Rescaled(volume.path, volume.shape_zyx, np.dtype(np.uint16), volume, (first, last))
    return codes, range_of_values


@dataclass(frozen=True)
class _Unsigned(RawVolume):
    """A volume of signed 16 bits, with 32768 added: exact, and in a tenth of the time of rescaling."""

    source: RawVolume
    """The volume."""

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return the codes of slices z0 to z1 - 1."""
        codes: NDArray[np.uint16] = self.source.read_slab(z0, z1).view(np.uint16)
        # In place, unless it is the volume itself: room for a copy takes the system longer to clear than all else here.
        in_place = None if isinstance(self.source, InMemory) else codes
        return np.bitwise_xor(codes, np.uint16(0x8000), out=in_place)


@dataclass(frozen=True)
class _Rescaled(RawVolume):
    """A volume of any type as codes of 16 bits."""

    source: RawVolume
    """The volume."""
    ends: tuple[float, float]
    """Stored values of the codes 0 and 65535."""

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return the codes of slices z0 to z1 - 1."""
        first, last = self.ends
        stored = self.source.read_slab(z0, z1).astype(np.float32)
        share = (stored - np.float32(first)) / np.float32((last - first) or 1.0)
        codes: NDArray[np.uint16] = np.rint(np.clip(share, 0.0, 1.0) * np.float32(65535)).astype(np.uint16)
        return codes


def _looks_by_ray(looks: Float32Array, rays: int) -> Float32Array:
    """Return [style, sample, 4] of so many rays of one length as [style, sample, ray, 4]."""
    styles = len(looks)
    return np.ascontiguousarray(looks.reshape(styles, rays, -1, 4).transpose(0, 2, 1, 3))


def _by_ray(values: Float64Array, rays: int) -> Float64Array:
    """Return the values of so many rays of one length as [sample, ray]."""
    return np.ascontiguousarray(values.reshape(rays, -1).T)
