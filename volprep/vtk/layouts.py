"""Figures of how a package lays out its volume: proxy meshes, bricks, sub-volumes with a walk, stacks of slices."""

import tempfile
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from volprep.truth.picture import encoded
from volprep.vtk.process import run_script
from volprep.vtk.shapes import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    TEAL,
    Panel,
    Points,
    Shape,
    Slice,
    Strokes,
    Surface,
    box_lines,
    box_surface,
    save_panels,
)
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.meshes import read_glb
from volprep_formats.output import write_file
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.parts.bricks.places import STORED, index_entries
from volprep_formats.package.parts.slices.record import AXES, StackAxis
from volprep_formats.package.parts.slices.texels import slice_texels
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes, require_png_place
from volprep_formats.textures import ktx2

_SECONDS = 300.0
_MOST_PANELS = 4
_SLICES = 6
"""Slices that are drawn of a stack; more would hide each other."""


def write_figure(package: Package, path: Path) -> tuple[int, int]:
    """Write the figure of a package to a PNG file, and return its width and height.

    Raises VP6043 if the package has no such layout, VP6040 and VP6041 if pyvista cannot draw, VP5021 if the file cannot
    be written.
    """
    require_png_place(path)
    picture = draw_figure(package)
    if picture is None:
        raise VolprepError("VP6043", path=package.path)
    write_file(path, png_bytes(picture), "VP5021")
    return picture.shape[1], picture.shape[0]


def draw_figure(package: Package) -> UInt8Array | None:
    """Draw the layouts of a package side by side, four at most, [H, W, RGB]; None if it has none.

    Raises VP6040 and VP6041 if pyvista cannot draw, and the errors of reading the package.
    """
    panels = [*panels_of(package)][:_MOST_PANELS]
    if not panels:
        return None
    with tempfile.TemporaryDirectory(prefix="volprep-") as folder:
        task, result = Path(folder) / "panels.npz", Path(folder) / "figure.npy"
        save_panels(panels, task)
        run_script("figure_pictures", task, result, seconds=_SECONDS)
        picture: UInt8Array = np.load(result)
    return picture


def panels_of(package: Package) -> Iterator[Panel]:
    """Describe the layouts of each channel, at the finest level that has them."""
    several = len(package.manifest.channels) > 1
    for name, part in channel_packages(package).items():
        grid = _voxels_grid(part)
        if grid is None:
            continue
        outline = Strokes(box_lines(np.zeros(3), np.array(grid.extent_mm_zyx[::-1])), GREY, 1.2)
        for title, shapes in (*_proxy(part), *_bricks(part), *_subvolumes(part), *_slices(part)):
            full = f"{name}: {title}" if several else title
            z, y, x = grid.extent_mm_zyx
            yield Panel(full, (x, y, z), np.array(grid.direction), [outline, *shapes])


def _voxels_grid(package: Package) -> Grid | None:
    """Return the grid of level 0, which the package may hold in pieces only; None before it is known."""
    manifest = package.manifest
    return manifest.grid or (manifest.levels[0].grid if manifest.levels else None)


def _proxy(package: Package) -> Iterator[tuple[str, list[Shape]]]:
    meshes = package.manifest.proxy.meshes if package.manifest.proxy else ()
    shown = [mesh for mesh in meshes if mesh.file is not None]
    if not shown:
        return
    mesh = min(shown, key=lambda mesh: mesh.level)
    file = mesh.file or ""
    shapes: list[Shape] = [
        Surface(
            primitive.positions_xyz.astype(np.float64) * mesh.box_from_mesh_mm_xyz,
            primitive.triangles.astype(np.int64),
            TEAL,
            0.85,
        )
        for primitive in read_glb(package.read_bytes(file), file).primitives
    ]
    yield f"proxy mesh of {mesh.transfer}, level {mesh.level}\n{mesh.triangles} triangles", shapes


def _bricks(package: Package) -> Iterator[tuple[str, list[Shape]]]:
    textures = package.manifest.textures
    pools = [texture for texture in textures if texture.bricks is not None and texture.level is not None]
    if not pools:
        return
    pool = min(pools, key=lambda pool: pool.level or 0)
    places = package.manifest.textures_of("bricks", level=pool.level)[0]
    layout = pool.bricks
    if layout is None:
        return
    grid = package.manifest.level(pool.level).grid
    entries = index_entries(ktx2.decode(package.read_bytes(places.file), places.file).data, places.mosaic)
    stored = np.argwhere(entries[..., 3] == STORED)
    cells = np.array(layout.cells_zyx)
    low = stored * cells
    high = np.minimum(low + np.maximum(cells, 1), np.array(grid.shape_zyx) - 1)
    points, faces = box_surface(_centres(grid, low), _centres(grid, high))
    title = f"bricks of level {pool.level}\n{layout.stored} of {entries[..., 3].size} are stored"
    yield title, [Surface(points, faces, ORANGE)]


def _subvolumes(package: Package) -> Iterator[tuple[str, list[Shape]]]:
    files = package.manifest.subvolumes
    if files is None:
        return
    pieces = decode_grid(package.read_bytes(files.grid), package.path, files.grid)
    grid = _voxels_grid(package)
    if grid is None:
        return
    low, high, held = _pieces(pieces)
    places = np.array([*product(*(range(len(cuts)) for cuts in pieces.cuts_zyx))])
    points = _centres(grid, _voxels(pieces, places))
    walk = _walk(pieces)
    at = pieces.points[int(np.ravel_multi_index(tuple(walk[-1]), [len(cuts) for cuts in pieces.cuts_zyx]))]
    around = np.isin(np.arange(len(held)), at.subvolumes)
    corners, faces = box_surface(_centres(grid, low[around]), _centres(grid, high[around]))
    path = _centres(grid, _voxels(pieces, np.array(walk)))
    shapes: list[Shape] = [
        Strokes(box_lines(_centres(grid, low[held]), _centres(grid, high[held])), BLUE, 1.0),
        Surface(corners, faces, ORANGE, 0.35),
        Points(points, BLUE, 7.0),
        Strokes(np.array([*pairwise(path)]).reshape(-1, 2, 3), RED, 5.0),
        Points(path[-1:], RED, 16.0),
    ]
    count = f"{int(held.sum())} of {len(held)} sub-volumes hold voxels"
    moves = "one move" if len(walk) == 2 else f"{len(walk) - 1} moves"
    yield f"{count}\na walk of {moves}, and the pieces held at its end", shapes


def _pieces(pieces: SubvolumeGrid) -> tuple[Float64Array, Float64Array, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return first and last voxels of all pieces [n, zyx], and which have a file."""
    spans = [*product(*(pairwise(cuts) for cuts in pieces.cuts_zyx))]
    low, high = (np.array([[span[side] for span in box] for box in spans], np.float64) for side in (0, 1))
    held = np.array([piece.file is not None for piece in pieces.subvolumes])
    # Pieces that are all in one file have no files of their own.
    return low, high, held if held.any() else np.ones_like(held)


def _walk(pieces: SubvolumeGrid) -> list[tuple[int, int, int]]:
    """Return the points [zyx] of a walk from corner to corner, as a device steps through them: along x, then y, then z.

    Points on the outside have fewer pieces around them: a walk avoids them if possible.
    """
    last = [len(cuts) - 1 for cuts in pieces.cuts_zyx]
    first, end = [min(1, n) for n in last], [max(n - 1, min(1, n)) for n in last]
    at = list(first)
    walk = [(at[0], at[1], at[2])]
    for axis in (2, 1, 0):
        while at[axis] < end[axis]:
            at[axis] += 1
            walk.append((at[0], at[1], at[2]))
    return walk


def _slices(package: Package) -> Iterator[tuple[str, list[Shape]]]:
    layouts = {texture.slices.axis: texture for texture in package.manifest.textures if texture.slices is not None}
    for axis, texture in sorted(layouts.items()):
        if texture.transfer is None or texture.level is None:
            continue
        grid = package.manifest.level(texture.level).grid
        texels = slice_texels(package, texture.transfer, axis)
        every = -(-len(texels) // _SLICES)
        shown = range(every // 2, len(texels), every)
        title = f"slices along {axis}, {texture.transfer}\n{len(texels)}, one of {every} is shown"
        yield title, [_slice(grid, axis, number, texels[number]) for number in shown]


def _slice(grid: Grid, axis: StackAxis, number: int, texels: UInt8Array) -> Slice:
    """Place a slice: rows and columns are z and y for x, z and x for y, y and x for z."""
    along = AXES[axis]
    rows, columns = (value for value in (0, 1, 2) if value != along)
    extent, spacing = grid.extent_mm_zyx, grid.spacing_mm_zyx
    corners = np.zeros((3, 3))
    corners[:, along] = (number + 0.5) * spacing[along]
    corners[1, columns] = extent[columns]
    corners[2, rows] = extent[rows]
    return Slice(corners[:, ::-1].copy(), encoded(texels / 255.0, "transparent"))


def _centres(grid: Grid, voxels_zyx: Float64Array) -> Float64Array:
    """Return the centres of voxels in box millimetres [n, xyz]."""
    centres: Float64Array = ((np.asarray(voxels_zyx) + 0.5) * grid.spacing_mm_zyx)[..., ::-1]
    return centres


def _voxels(pieces: SubvolumeGrid, places_zyx: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> Float64Array:
    """Return the voxels on which points of the grid lie."""
    return np.column_stack(
        [np.array(cuts, np.float64)[places_zyx[:, axis]] for axis, cuts in enumerate(pieces.cuts_zyx)]
    )
