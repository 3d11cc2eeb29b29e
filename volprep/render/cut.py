"""A box of level 0 around a place that the user chose, at full resolution, out of a package that has sub-volumes.

The custom sub-volume of the Beaver Volume Renderer (Schultz and Bailey, 7.4). Only the voxels of the box are read, from
the file of the whole level or from the pieces that the box meets.
"""

from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from volprep.truth.volume import Volume
from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid, Vector
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.mipmaps.texels import texture_from_box
from volprep_formats.package.parts.segments.texels import labels_of_texels
from volprep_formats.package.parts.subvolumes.record import (
    Cuts,
    SubvolumeGrid,
    constant_texture,
    decode_grid,
    label_bytes,
)
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.contents import open_contents
from volprep_formats.record import Record
from volprep_formats.textures.ktx2_box import Box, Ktx2Box

Index = tuple[int, int, int]


class LevelMark(Record):
    """Where the box lies in a level, for an app that highlights it."""

    level: int
    """Level."""
    low_str: Vector
    """Texture coordinates of the box's lower corner."""
    high_str: Vector
    """Texture coordinates of the box's upper corner."""


class CutRecord(Record):
    """A cut: its package, its box and its cost."""

    package: str
    """Name of the scene."""
    start_zyx: tuple[int, int, int]
    """First voxel of level 0 along each axis."""
    stop_zyx: tuple[int, int, int]
    """Voxel after the last one along each axis."""
    grid: Grid
    """Positions of the voxels."""
    slope: float
    """physical = slope · code + intercept. Texels hold code / largest code."""
    intercept: float
    """physical = slope · code + intercept."""
    marks: tuple[LevelMark, ...]
    """Where the box lies in each level that the package holds."""
    files_read: int
    """Texture files that were opened."""
    reads: int
    """Calls of the system that read something from them."""
    texel_bytes_read: int
    """Bytes of texels that were read."""
    empty_pieces: int
    """Pieces that the box meets and the package does not hold, since nothing of them is seen: filled with their
    smallest code."""


@dataclass(frozen=True)
class Cut:
    """A box of level 0."""

    texels: NDArray[np.generic]
    """[z, y, x], uint8, uint16 or float16, as the textures of the package hold them."""
    record: CutRecord
    """Description of the cut."""
    nearest: bool = False
    """Whether voxels are labels."""
    labels: UInt8Array | None = None
    """[z, y, x, byte], the labels of segments and their flags, as pieces hold them; None without segments."""

    @property
    def volume(self) -> Volume:
        """The field that an app draws."""
        record = self.record
        if self.texels.dtype.kind != "f":
            return Volume(self.texels, record.grid, record.slope, record.intercept, self.nearest)
        # Half floats are normalised codes of 16 bits.
        stored = self.texels.astype(np.float32)
        return Volume(stored, record.grid, record.slope * 65535, record.intercept, self.nearest)

    @property
    def numbers(self) -> NDArray[np.uint16] | None:
        """[z, y, x], the label of each voxel; None without segments."""
        if self.labels is None:
            return None
        return labels_of_texels(self.labels[..., 0] if self.labels.shape[-1] == 1 else self.labels)


def cut(package: Package, center_xyz: tuple[float, float, float], size: int) -> Cut:
    """Cut a box of at most `size` voxels along each axis around the voxel `center_xyz` of level 0.

    A box that would reach beyond the volume is moved inside; an axis shorter than `size` is taken whole. Raises VP4051
    for a center outside the volume, and the errors of `cut_box`.
    """
    grid = package.manifest.grid
    if package.manifest.subvolumes is None or grid is None:
        raise VolprepError("VP4050", path=package.path)
    return cut_box(package, _box(package, center_xyz, size, grid.shape_zyx))


def cut_box(package: Package, box: Box) -> Cut:
    """Cut a box of level 0, voxels along z, y and x.

    Raises VP4050 for a package without sub-volumes, VP4007 and VP4030 for files that are damaged. Checksums are not
    compared: that would read every file whole.
    """
    manifest = package.manifest
    files, level_grid, quantization = manifest.subvolumes, manifest.grid, manifest.quantization
    if files is None or level_grid is None or quantization is None:
        raise VolprepError("VP4050", path=package.path)
    start_zyx, stop_zyx = _corners(box)
    with ExitStack() as stack:
        grid = decode_grid(package.read_bytes(files.grid), package.path, files.grid)
        found = _Reading(package, stack)
        texels = found.pieces(grid, box) if grid.whole is None else found.whole(grid.whole, box)
    values, labels = (texels, None) if texels.ndim == 3 else (texels[..., 0], texels[..., 1:].astype(np.uint8))
    return Cut(
        np.ascontiguousarray(values),
        CutRecord(
            package=manifest.name,
            start_zyx=start_zyx,
            stop_zyx=stop_zyx,
            grid=level_grid.part(start_zyx, stop_zyx),
            slope=quantization.slope,
            intercept=quantization.intercept,
            marks=tuple(_mark(manifest, level, start_zyx, stop_zyx) for level in manifest.levels),
            files_read=len(found.opened),
            reads=sum(box.reads for box in found.opened),
            texel_bytes_read=sum(box.texel_bytes_read for box in found.opened),
            empty_pieces=found.empty,
        ),
        grid.filter == "nearest",
        labels,
    )


class _Reading:
    """Reads a box, and keeps the files that were opened, for their counts."""

    def __init__(self, package: Package, stack: ExitStack) -> None:
        self._package = package
        self._stack = stack
        self.opened: list[Ktx2Box] = []
        self.empty = 0

    def whole(self, path: str, box: Box) -> NDArray[np.generic]:
        return self._open(path).box(box)

    def pieces(self, grid: SubvolumeGrid, box: Box) -> NDArray[np.generic]:
        """Return values [z, y, x], or with labels [z, y, x, component]."""
        held = label_bytes(grid.texture_format)
        texels = np.zeros((*_shape(box), *(1 + held,) * bool(held)), constant_texture(None, grid.texture_format).dtype)
        spans = [_met(cuts, along) for cuts, along in zip(grid.cuts_zyx, box, strict=True)]
        _, ny, nx = grid.counts_zyx
        met = {(k, j, i): (z, y, x) for k, z in spans[0] for j, y in spans[1] for i, x in spans[2]}
        pieces = {(k, j, i): grid.subvolumes[i + nx * (j + ny * k)] for k, j, i in met}
        empty = {place for place, piece in pieces.items() if piece.file is None}
        self.empty += len(empty)
        for place in empty:
            part = texels[_moved(met[place], _corners(box)[0])]
            voxel = constant_texture(pieces[place], grid.texture_format)
            # Where texels hold several slices, all have the same code.
            part[...] = voxel if held else voxel.flat[0]
        # After the empty ones, because of the layers that they share.
        for (k, j, i), piece in pieces.items():
            if piece.file is not None:
                span = _with_shared(grid, (k, j, i), met[k, j, i], box, empty)
                z, y, x = (spans[at][0] for spans, at in zip(grid.spans_zyx, (k, j, i), strict=True))
                own, out = _moved(span, (z, y, x)), texels[_moved(span, _corners(box)[0])]
                out[...] = self._texels(grid, i + nx * (j + ny * k), piece.file, own)
        return texels

    def _texels(self, grid: SubvolumeGrid, number: int, file: str, own: Box) -> NDArray[np.generic]:
        """Return a box of a piece, with labels if it holds them."""
        if grid.mosaic is None:
            return self._open(file).box(own, 1 + label_bytes(grid.texture_format))
        return grid.voxels_of_mosaic(number, self._open(file).texels())[own]

    def _open(self, path: str) -> Ktx2Box:
        held = self._stack.enter_context(open_contents(self._package.path, path))
        name = f"{self._package.path}: {path}"
        self.opened.append(Ktx2Box(held.file.fileno(), held.start_bytes, held.size_bytes, name))
        return self.opened[-1]


def _box(package: Package, center_xyz: tuple[float, float, float], size: int, shape_zyx: tuple[int, int, int]) -> Box:
    center_zyx = center_xyz[::-1]
    if not all(-0.5 <= at <= n - 0.5 for at, n in zip(center_zyx, shape_zyx, strict=True)):
        shown = " × ".join(str(n) for n in shape_zyx[::-1])
        raise VolprepError("VP4051", path=package.path, center=",".join(f"{at:g}" for at in center_xyz), shape=shown)
    z, y, x = (_span(at, min(size, n), n) for at, n in zip(center_zyx, shape_zyx, strict=True))
    return z, y, x


def _span(center: float, size: int, voxels: int) -> slice:
    # Half the voxels before the center: the place itself is in the middle as nearly as it can be.
    start = min(max(int(np.rint(center - (size - 1) / 2)), 0), voxels - size)
    return slice(start, start + size)


def _met(cuts: Cuts, along: slice) -> list[tuple[int, slice]]:
    """Pieces that a span of voxels meets, each with the voxels that are read from it: shared ones once."""
    owned = [(low, high if piece < len(cuts) - 2 else high + 1) for piece, (low, high) in enumerate(pairwise(cuts))]
    spans = [(piece, slice(max(low, along.start), min(high, along.stop))) for piece, (low, high) in enumerate(owned)]
    return [(piece, span) for piece, span in spans if span.start < span.stop]


def _with_shared(grid: SubvolumeGrid, place: Index, span: Box, box: Box, empty: set[Index]) -> Box:
    """Return the voxels that are read from a piece, with the shared ones above it where a piece there is empty.

    An empty piece has one code for all voxels, which is wrong between its voxels and its neighbour's.
    """
    above = set(product(*((at, at + 1) for at in place)))
    if above.isdisjoint(empty):
        return span
    z, y, x = (
        slice(side.start, max(side.stop, min(cuts[at + 1] + 1, whole.stop)))
        for side, cuts, at, whole in zip(span, grid.cuts_zyx, place, box, strict=True)
    )
    return z, y, x


def _moved(box: Box, corner_zyx: tuple[int, int, int]) -> Box:
    z, y, x = (slice(side.start - at, side.stop - at) for side, at in zip(box, corner_zyx, strict=True))
    return z, y, x


def _shape(box: Box) -> tuple[int, int, int]:
    z, y, x = (side.stop - side.start for side in box)
    return z, y, x


def _corners(box: Box) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    z, y, x = box
    return (z.start, y.start, x.start), (z.stop, y.stop, x.stop)


def _mark(
    manifest: Manifest, level: Level, start_zyx: tuple[int, int, int], stop_zyx: tuple[int, int, int]
) -> LevelMark:
    grid = manifest.grid or manifest.source.info.grid
    scale = np.array(grid.spacing_mm_zyx[::-1]) * texture_from_box(level, manifest.textures)
    low, high = (tuple((np.array(corner[::-1]) * scale).tolist()) for corner in (start_zyx, stop_zyx))
    return LevelMark(level=level.index, low_str=low, high_str=high)
