"""A level put together from its bricks."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.textures.mosaic import slices_of_mosaic

STORED = 255
"""Alpha of an entry whose red, green and blue are the position of a brick; 0 if the brick has a single value."""


def constant_entry(normalised: Float64Array) -> UInt8Array:
    """Entries [..., RGBA] of single-value bricks, values from 0 to 1: upper and lower byte of a 16-bit number."""
    value = np.rint(normalised * 65535).astype(np.uint16)
    nothing = np.zeros_like(value)
    return np.stack([value >> 8, value & 255, nothing, nothing], axis=-1).astype(np.uint8)


def index_entries(texels: NDArray[np.generic], mosaic: MosaicLayout | None) -> UInt8Array:
    """Return the entries [z, y, x, RGBA] of an index from its texels, of a 3D texture or of a mosaic.

    There are no entries if the mosaic does not say how the texels lie.
    """
    if mosaic is None:
        return np.asarray(texels, np.uint8)
    (rows, columns), (height, width) = mosaic.pitch_yx, mosaic.texture_shape_yx
    fits = mosaic.tiles_y * rows <= height and mosaic.tiles_x * columns <= width
    plain = (mosaic.textures, mosaic.slices_per_texel, mosaic.components_per_voxel) == (1, 1, 4)
    if not (
        plain and fits and texels.shape == (1, height, width, 4) and mosaic.slices <= mosaic.tiles_x * mosaic.tiles_y
    ):
        return np.empty((0, 0, 0, 4), np.uint8)
    return np.asarray(slices_of_mosaic([texels[0]], mosaic), np.uint8)


def misplaced(entries: UInt8Array, layout: BrickLayout) -> str | None:
    """Return the problems of the entries of a level's bricks."""
    stored = entries[entries[..., 3] == STORED][:, 2::-1].astype(np.int64)
    shape = entries.shape[:3]
    if shape != layout.bricks_zyx or len(stored) != layout.stored:
        return f"has {len(stored)} stored bricks of {shape}, the manifest {layout.stored} of {layout.bricks_zyx}"
    if (stored >= layout.pool_zyx).any() or len(np.unique(stored, axis=0)) != len(stored):
        return f"places bricks twice, or outside of the {layout.pool_zyx} places"
    return None


def voxels_of_bricks(
    pool: NDArray[np.generic], entries: UInt8Array, layout: BrickLayout, shape_zyx: tuple[int, int, int]
) -> NDArray[np.generic]:
    """Return the voxels [z, y, x] of a level from its pool [z, y, x] and the entries [z, y, x, RGBA]."""
    level: NDArray[np.generic] = np.empty(shape_zyx, pool.dtype)
    largest = 1.0 if pool.dtype.kind == "f" else 2.0 ** (8 * pool.dtype.itemsize) - 1
    for place in np.ndindex(entries.shape[:3]):
        first = [at * cells for at, cells in zip(place, layout.cells_zyx, strict=True)]
        box = tuple(slice(at, at + cells + 1) for at, cells in zip(first, layout.cells_zyx, strict=True))
        target, entry = level[box], entries[place]
        if entry[3] != STORED:
            target[...] = (int(entry[0]) * 256 + int(entry[1])) / 65535 * largest
            continue
        corner = [int(at) * pitch + layout.reach - 1 for at, pitch in zip(entry[2::-1], layout.pitch_zyx, strict=True)]
        target[...] = pool[tuple(slice(at, at + n) for at, n in zip(corner, target.shape, strict=True))]
    return level
