"""The surface that a picture of a package shows, as meshes: of the scan, or of each segment."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.surface.lines import LineHits, LineSide, hits_by_opacity, hits_by_threshold, sides, values_at
from volprep.surface.mesh import IndexMesh, closed_mesh, decimated, error_of, positions_mm
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.installation import generator, require_extra
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.function_table import Table
from volprep_formats.package.look import looks_of
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress
from volprep_formats.readers.volpkg import open_level
from volprep_formats.srgb import linear_of_srgb
from volprep_formats.writers.label_image import LabelImage, WrittenSegment
from volprep_formats.writers.package_labels import labels_of_level
from volprep_formats.writers.surface_records import SurfaceFacts, SurfaceMesh, SurfaceNode, Surfaces

_INWARDS = 6.0
"""Voxels behind the surface that may colour it."""
_PARTS = 24
_SMOOTH = 0.6
"""Standard deviation, in voxels, of the filter that takes the stairs from labels."""
_BORDER = 0.5
_MARGIN = 3
"""Voxels around a segment, which the filter reaches."""
_OF_A_VALUE = frozenset(("first-hit", "isosurface"))
_WITHOUT_SURFACE = frozenset(("maximum", "minimum", "average"))


def surfaces_of(
    path: Path,
    progress: Progress,
    *,
    level: int | None = None,
    transfer: str | None = None,
    within_mm: float | None = None,
    frame: int = 0,
) -> Surfaces:
    """Return the surface that a picture shows at a level, the finest if None, and in a frame of a time series.

    With segments each visible one is a mesh, unless `transfer` names a transfer function of the scan. Triangles are
    joined while 95 % of them stay within `within_mm` of the surface; a quarter of a voxel if None.

    Raises VP7005 (an extra is missing), VP1333 (no surface) and what `open_level` raises.
    """
    require_extra("surface")
    package = Package.open(path, allow_draft=True)
    segments = package.manifest.segments
    if segments is not None and transfer in {None, segments.name}:
        image, source = labels_of_level(path, level, segments.name)
        with source:
            grid = source.info.grid
            labels = source.read_slab(0, grid.shape_zyx[0])
        made = [*_of_segments(image, labels, grid, _limit(grid, within_mm), progress)]
        words, function = f"borders of labels, smoothed by {_SMOOTH} voxels", segments.name
    else:
        one, words, function, grid = _of_scan(path, progress, level, transfer, within_mm, frame=frame)
        made = [] if one is None else [one]
    if not made:
        raise VolprepError("VP1333", path=path, reason="nothing of it is opaque enough to hide what is behind it")
    facts = SurfaceFacts(
        generator=generator(),
        package=package.manifest.name,
        level=_number(package, grid),
        function=function,
        surface=words,
        decimated_within_mm=max(moved for _, _, moved in made),
        nodes=tuple(node for _, node, _ in made),
    )
    return Surfaces(tuple(mesh for mesh, _, _ in made), facts, looks_of(package.manifest))


_Made = tuple[SurfaceMesh, SurfaceNode, float]


def _limit(grid: Grid, within_mm: float | None) -> float:
    return 0.25 * min(grid.spacing_mm_zyx) if within_mm is None else within_mm


def _number(package: Package, grid: Grid) -> int:
    """Return the number of the level with a grid."""
    return next((level.index for level in package.manifest.levels if level.grid == grid), 0)


def _of_scan(
    path: Path, progress: Progress, level: int | None, transfer: str | None, within_mm: float | None, *, frame: int
) -> tuple[_Made | None, str, str, Grid]:
    """Return the surface of a transfer function, what it is in words, the name of the function and the grid."""
    manifest = package_of_transfer(Package.open(path, allow_draft=True), transfer).manifest
    function = next(function for function in manifest.transfer_functions if transfer in {None, function.name})
    drawn = {
        name for picture in manifest.pictures if picture.media[0].transfer == function.name for name in picture.programs
    }
    compositings = {program.compositing for program in manifest.programs if program.name in drawn}
    if compositings & _WITHOUT_SURFACE:
        raise VolprepError("VP1333", path=path, reason=f"{function.name} shows {min(compositings)} values of rays")
    channel = manifest.channels[0].name
    with open_level(path, level, channel, frame) as source:
        info = source.info
        values = source.read_slab(0, info.grid.shape_zyx[0]).astype(np.float32) * np.float32(info.slope)
        values += np.float32(info.intercept)
    progress.start("measuring the surface", 3)
    shown = _shown(values, Table.exact(function), info.grid, of_value=bool(compositings & _OF_A_VALUE))
    if shown is None:
        return None, "", function.name, info.grid
    progress.advance()
    mesh = closed_mesh(shown.field, shown.threshold, info.grid)
    if mesh is None:
        return None, "", function.name, info.grid
    mesh, moved = decimated(mesh, shown.field, shown.threshold, info.grid, _limit(info.grid, within_mm))
    progress.advance()
    colours = _colours(mesh, values, Table.exact(function), info.grid, of_value=shown.of_value)
    made = _made(function.name, mesh, colours, shown.hits, info.grid)
    progress.advance()
    return (*made, moved), shown.words, function.name, info.grid


@dataclass(frozen=True)
class _Shown:
    """The surface that a transfer function shows."""

    field: Float32Array
    threshold: float
    hits: list[tuple[LineSide, LineHits]]
    words: str
    of_value: bool


def _shown(values: Float32Array, table: Table, grid: Grid, *, of_value: bool) -> _Shown | None:
    """Return the field and its threshold, and what rays hit; None if no ray hits anything."""
    each = [*sides(grid.shape_zyx)]
    if of_value and table.isovalue is not None:
        threshold = table.isovalue
        colour = table.at(np.array([threshold]))[0][0]
        hits = [(side, hits_by_threshold(values, side, threshold, colour)) for side in each]
        return _Shown(values, threshold, hits, f"values of {threshold:g}", of_value=True)
    hits = [(side, hits_by_opacity(values, side, table, grid.spacing_mm_zyx[side.axis])) for side in each]
    rising = np.diff(table.extinction_per_mm)
    if (rising >= 0).all():
        field, name = values, "values"
    else:
        field, name = (
            table.at(values.reshape(-1).astype(np.float64))[1].reshape(values.shape).astype(np.float32),
            "extinctions",
        )
    at_hits = np.concatenate([values_at(field, side, found) for side, found in hits])
    if not at_hits.size:
        return None
    threshold = float(np.median(at_hits))
    words = f"{name} of {threshold:.6g}, the median of where rays from six sides are half opaque"
    return _Shown(field, threshold, hits, words, of_value=False)


def _colours(mesh: IndexMesh, values: Float32Array, table: Table, grid: Grid, *, of_value: bool) -> Float64Array:
    """Return the linear colours of vertices: what a short ray inwards ends with."""
    if of_value and table.isovalue is not None:
        colour = table.at(np.array([table.isovalue]))[0][0]
        return np.broadcast_to(colour, (len(mesh.positions_zyx), 3))
    from scipy.ndimage import map_coordinates  # noqa: PLC0415 - in an extra

    spacing = np.array(grid.spacing_mm_zyx)
    handed = np.sign(np.linalg.det(np.array(grid.direction)))
    inwards = -handed * _normals(mesh.positions_zyx * spacing, mesh.triangles) * min(spacing)
    step_mm = (1.0 + _INWARDS) * min(spacing) / _PARTS
    light, left = np.zeros((len(inwards), 3)), np.ones(len(inwards))
    for part in range(_PARTS):
        along = -1.0 + (1.0 + _INWARDS) * (part + 0.5) / _PARTS
        places = mesh.positions_zyx + along * inwards / spacing
        sampled = map_coordinates(values, places.T, order=1, mode="nearest").astype(np.float64)
        colour, extinction = table.at(sampled)
        after = left * np.exp(-extinction * step_mm)
        light += (left - after)[:, None] * colour
        left = after
    whole = 1.0 - left
    nothing = table.at(np.array([table.values[table.extinction_per_mm.argmax()]]))[0][0]
    return np.where(whole[:, None] > 1e-6, light / np.maximum(whole, 1e-6)[:, None], nothing)


def _normals(positions: Float64Array, triangles: NDArray[np.int64]) -> Float64Array:
    """Return unit normals [vertex, 3] by area, outwards where triangles are counter-clockwise in x, y, z."""
    corners = positions[:, ::-1][triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack(
        [np.bincount(triangles.reshape(-1), np.repeat(part, 3), len(positions)) for part in across.T], axis=1
    )
    unit: Float64Array = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-30)
    return unit[:, ::-1]


def _of_segments(
    image: LabelImage, labels: NDArray[np.generic], grid: Grid, within_mm: float, progress: Progress
) -> Iterator[_Made]:
    """Yield the mesh of each segment that is visible at first."""
    from scipy.ndimage import find_objects, gaussian_filter  # noqa: PLC0415 - in an extra

    codes, numbered = np.unique(labels, return_inverse=True)
    boxes = dict(zip(codes.tolist(), find_objects(numbered.reshape(labels.shape) + 1), strict=True))
    seen = {member for entry in image.entries if entry.rgba[3] > 0 for member in entry.members}
    progress.start("surfaces of segments", len(image.segments))
    for index, segment in enumerate(image.segments):
        progress.advance()
        values = [entry.value for entry in image.entries if index in entry.members and entry.value in boxes]
        if index not in seen or not values:
            continue
        box = tuple(
            slice(max(0, min(span.start for span in spans) - _MARGIN), max(span.stop for span in spans) + _MARGIN)
            for spans in zip(*(boxes[value] for value in values), strict=True)
        )
        part = np.isin(labels[box], values).astype(np.float32)
        inside = _part_of(grid, [span.start for span in box], part.shape)
        # A segment of few voxels may vanish in the filter.
        smooth = gaussian_filter(part, _SMOOTH)
        field = smooth if smooth.max() > _BORDER else part
        found = closed_mesh(field, _BORDER, inside)
        if found is None:
            continue
        mesh, moved = decimated(found, field, _BORDER, inside, within_mm)
        colour = _linear(segment)
        hits = [(side, hits_by_threshold(part, side, _BORDER, colour)) for side in sides(inside.shape_zyx)]
        yield (*_made(segment.name, mesh, np.broadcast_to(colour, (len(mesh.positions_zyx), 3)), hits, inside), moved)


def _part_of(grid: Grid, start_zyx: list[int], shape_zyx: tuple[int, ...]) -> Grid:
    nz, ny, nx = shape_zyx
    origin = grid.world_from_index[:3] @ [*start_zyx[::-1], 1.0]
    return Grid.of((nz, ny, nx), grid.spacing_mm_zyx, origin, grid.direction)


def _linear(segment: WrittenSegment) -> Float64Array:
    return np.array([linear_of_srgb(part / 255) for part in segment.rgb])


def _made(
    name: str, mesh: IndexMesh, colours: Float64Array, hits: list[tuple[LineSide, LineHits]], grid: Grid
) -> tuple[SurfaceMesh, SurfaceNode]:
    error = error_of(mesh, colours, hits, grid)
    node = SurfaceNode(name=name, triangles=len(mesh.triangles), watertight=mesh.is_watertight, error=error)
    positions = positions_mm(mesh.positions_zyx, grid)
    # Positions of a left-handed grid turn triangles over; `closed_mesh` has turned them back.
    normals = _normals(positions[:, ::-1], mesh.triangles)[:, ::-1]
    return SurfaceMesh(name, positions, normals, np.clip(colours, 0.0, 1.0), mesh.triangles), node
