"""The true picture of a part of a volume: a box within it, whose faces may lie anywhere.

An oracle integrates over the whole box of a volume, whose upper end along an axis is given by its extent, and whose
lower end is half a voxel outside the first centre. So the volume is turned until a ray leaves the part through an upper
face, and the near plane of the camera is laid into the lower face through which the ray enters. Rays with other
directions along the axes, or with other entry faces, have pictures of their own: each pixel is taken from the picture
that is right for it, with its bound. Nothing is interpolated again.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.truth.oracle import OraclePicture
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

Draw = Callable[[Volume, Float64Array, tuple[int, int]], OraclePicture]
"""Draws a volume with a camera in its box."""

_FAR = 10.0
"""A depth far behind every volume that lies between the planes of a camera with parallel rays."""
_MARGIN = 1.001
"""Distance of the far plane, as a multiple of the part's."""


@dataclass(frozen=True)
class Inside:
    """Ranges of the rays of pixels within a box; arrays [pixel, xyz] or [pixel]."""

    directions: Float64Array
    """From the near to the far plane, as long as between them."""
    enters: Float64Array
    """Depth where each ray crosses the nearer face of the box, along each axis, as a part of its way."""
    leaves: Float64Array
    """Depth where it crosses the other face."""

    @property
    def hits(self) -> NDArray[np.bool_]:
        """Whether each ray meets the box."""
        found: NDArray[np.bool_] = np.maximum(self.enters.max(axis=1), 0.0) < np.minimum(self.leaves.min(axis=1), 1.0)
        return found


def picture_of_part(
    draw: Draw,
    volume: Volume,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    ends_mm_xyz: tuple[Float64Array, Float64Array],
) -> OraclePicture:
    """Draw the part of a volume between two corners in its box; `box_from_clip` leads to the volume's box."""
    low_mm, high_mm = ends_mm_xyz
    rays = _inside(box_from_clip, shape_hw, low_mm, high_mm)
    rgba, bound = np.zeros((len(rays.directions), 4)), np.zeros(len(rays.directions))
    signs = rays.directions < 0.0
    first = rays.enters.argmax(axis=1)
    for backwards in product((False, True), repeat=3):
        turned = _turned_matrix(box_from_clip, volume.grid, backwards)
        upper_mm = np.where(backwards, _extent(volume.grid) - low_mm, high_mm)
        lower_mm = np.where(backwards, _extent(volume.grid) - high_mm, low_mm)
        same = rays.hits & (signs == backwards).all(axis=1)
        # A ray that begins within the part keeps its own beginning.
        cameras = [(same & (rays.enters.max(axis=1) <= 0.0), turned)]
        for axis in range(3):
            pixels = same & (first == axis) & (rays.enters[:, axis] > 0.0)
            cameras += _from_plane(turned, axis, float(lower_mm[axis]), shape_hw, pixels, rays.leaves.min(axis=1))
        for pixels, matrix in cameras:
            if pixels.any():
                picture = draw(_turned_volume(volume, backwards, upper_mm), matrix, shape_hw)
                rgba[pixels], bound[pixels] = picture.rgba.reshape(-1, 4)[pixels], picture.bound.ravel()[pixels]
    return OraclePicture(rgba.reshape(*shape_hw, 4), bound.reshape(shape_hw))


def _inside(
    box_from_clip: Float64Array, shape_hw: tuple[int, int], low_mm: Float64Array, high_mm: Float64Array
) -> Inside:
    near, far = (_unprojected(box_from_clip, shape_hw, depth) for depth in (-1.0, 1.0))
    directions = far - near
    # A ray across an axis passes its faces nowhere: it is between them all the way, or never.
    across = np.abs(directions) <= 1e-12 * np.linalg.norm(directions, axis=1, keepdims=True)
    directions = np.where(across, 0.0, directions)
    between = (near >= low_mm) & (near <= high_mm)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(low_mm - near) / directions, (high_mm - near) / directions])
    enters = np.where(across, np.where(between, -np.inf, np.inf), ends.min(axis=0))
    leaves = np.where(across, np.where(between, np.inf, -np.inf), ends.max(axis=0))
    return Inside(directions, enters, leaves)


def _clip_xy(shape_hw: tuple[int, int]) -> tuple[Float64Array, Float64Array]:
    height, width = shape_hw
    y, x = np.meshgrid(1 - (2 * np.arange(height) + 1) / height, (2 * np.arange(width) + 1) / width - 1, indexing="ij")
    return x.ravel(), y.ravel()


def _unprojected(box_from_clip: Float64Array, shape_hw: tuple[int, int], depth: float) -> Float64Array:
    x, y = _clip_xy(shape_hw)
    box = np.stack([x, y, np.full_like(x, depth), np.ones_like(x)], axis=-1) @ box_from_clip.T
    places: Float64Array = box[:, :3] / box[:, 3:]
    return places


def _extent(grid: Grid) -> Float64Array:
    extent: Float64Array = np.array(grid.shape_zyx[::-1]) * np.array(grid.spacing_mm_zyx[::-1])
    return extent


def _turned_matrix(box_from_clip: Float64Array, grid: Grid, backwards: tuple[bool, ...]) -> Float64Array:
    turn = np.eye(4)
    for axis in np.flatnonzero(backwards):
        turn[axis, axis], turn[axis, 3] = -1.0, _extent(grid)[axis]
    turned: Float64Array = turn @ box_from_clip
    return turned


def _turned_volume(volume: Volume, backwards: tuple[bool, ...], upper_mm: Float64Array) -> Volume:
    """Return the volume with some axes the other way round, and a box that ends at `upper_mm`."""
    axes = tuple(2 - axis for axis, turned in enumerate(backwards) if turned)
    z, y, x = upper_mm[::-1].tolist()
    cut = volume.grid.model_copy(update={"extent_mm_zyx": (z, y, x)})
    return replace(volume, stored=np.ascontiguousarray(np.flip(volume.stored, axes)), grid=cut)


def _from_plane(  # noqa: PLR0917 - a camera, a plane, and for whom
    box_from_clip: Float64Array,
    axis: int,
    at_mm: float,
    shape_hw: tuple[int, int],
    pixels: NDArray[np.bool_],
    leaves: Float64Array,
) -> list[tuple[NDArray[np.bool_], Float64Array]]:
    """Return cameras with their near plane where the box coordinate `axis` is `at_mm`, and the same rays.

    Each with the pixels that it is for. A plane is a depth that changes evenly over the picture. The far plane is
    tilted with it; it lies behind where these rays leave the part, `leaves`, and before infinity. In a strong
    perspective no tilted plane does so for all pixels: then they are parted.
    """
    if not pixels.any():
        return []
    plane = box_from_clip[axis] - at_mm * box_from_clip[3]
    tilt = -plane[[0, 1, 3]] / plane[2]
    x, y = _clip_xy(shape_hw)
    begins = tilt[0] * x + tilt[1] * y + tilt[2]
    row = box_from_clip[3]
    near, far = (row[0] * x + row[1] * y + depth * row[2] + row[3] for depth in (-1.0, 1.0))
    # From a part of the way in millimetres to a depth.
    way = np.clip(leaves, 0.0, 1.0)
    ends = 2.0 * way * near / (far + way * (near - far)) - 1.0
    infinity = -row[3] / row[2] if row[2] else _FAR
    found = []
    waiting = [np.flatnonzero(pixels)]
    while waiting:
        portion = waiting.pop()
        if not len(portion):
            continue
        depth = _MARGIN * float((ends - begins)[portion].max())
        farthest = float(begins[portion].max()) + depth
        if farthest >= infinity and len(portion) > 1:
            order = portion[np.argsort(begins[portion], kind="stable")]
            waiting += [order[: len(order) // 2], order[len(order) // 2 :]]
            continue
        moved = np.eye(4)
        moved[2] = [tilt[0], tilt[1], depth / 2, tilt[2] + depth / 2]
        chosen = np.zeros(len(pixels), np.bool_)
        chosen[portion] = True
        found.append((chosen, box_from_clip @ moved))
    return found
