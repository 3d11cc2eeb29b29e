"""Rays of a view through the index of bricks: what each brick would change in the picture.

A ray passes cells, the bricks of level 0. In front of a cell lie others whose opacity is known from the index, so that
what is hidden counts less. A brick of level k changes a ray that passes it by its loss, times the light that reaches
it, times the part of its edge that the ray covers in each cell. The loss of a ray by one level is at most the sum
over its bricks: the triangle inequality, also for root mean squares over the pixels of a brick. The squares of
levels add up: voxels of a level are about means of the finer ones, whose differences from them cancel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.render.on_demand.bricks import BrickFile, Held
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.on_demand.index import LOSS_FOOTPRINTS

RAYS = 48
"""Rays along each axis of the picture."""


@dataclass(frozen=True)
class ViewLoss:
    """The changes that bricks would make in one view."""

    cells: NDArray[np.intp]
    """Number of the cell [ray, segment], row by row, along each ray."""
    losses: Float64Array
    """Loss [level, ray, segment] where a cell is drawn from the level after this one."""
    seen: float
    """Number of rays that see something, at least."""

    def gains(self, bricks: BrickFile) -> list[Float64Array]:
        """Return for each level but the coarsest the loss [z, y, x] that each brick takes away from all rays."""
        shape = bricks.records[0].shape
        found = []
        for level, losses in enumerate(self.losses):
            weights: Float64Array = losses.ravel()
            gain = np.bincount(self.cells.ravel(), weights, minlength=int(np.prod(shape))).astype(np.float64)
            gain = gain.reshape(shape)
            for axis, factor in enumerate(bricks.layout.factors_zyx[level]):
                gain = np.add.reduceat(gain, np.arange(0, gain.shape[axis], factor), axis)
            found.append(gain)
        return found

    def bound(self, bricks: BrickFile, held: Held) -> float:
        """Return the largest error of the picture drawn from these bricks against that from all of them.

        Root mean square over seen pixels and the four channels, premultiplied linear.
        """
        if not self.seen:
            return 0.0
        level = levels_at_cells(bricks, held).ravel()[self.cells]
        squares = sum(np.where(level > k, losses, 0.0).sum(axis=1) ** 2 for k, losses in enumerate(self.losses))
        return float(np.sqrt(np.minimum(squares, 1.0).sum() / self.seen))


def levels_at_cells(bricks: BrickFile, held: Held) -> NDArray[np.intp]:
    """Return the finest level [z, y, x] that is held at each cell; bricks of one value are held wherever they are."""
    found = np.full(bricks.records[0].shape, bricks.coarsest)
    for level in reversed(range(bricks.coarsest)):
        there = held[level] | (bricks.records[level]["size_bytes"] == 0)
        found[bricks.at_cells(level, there).astype(bool)] = level
    return found


def view_loss(
    bricks: BrickFile, box_from_clip: Float64Array, shape_hw: tuple[int, int], *, one_ray: bool = False
) -> ViewLoss:
    """Follow rays of a picture of this size through the cells.

    A pixel is the mean of its rays, whose errors cancel in part where voxels are smaller; with `one_ray` it is one.
    """
    near, far, beside = _ends(box_from_clip, shape_hw)
    ray = far - near
    length = np.linalg.norm(ray, axis=1)
    at, chord = _segments(bricks, near, ray)
    middle = near[:, None] + ray[:, None] * (at[:, :, None] + chord[:, :, None] / 2)
    chord = chord * length[:, None]
    cells_zyx = _cells(bricks, middle)
    cells = np.ravel_multi_index(cells_zyx, bricks.records[0].shape)
    share = (ray / length[:, None]) ** 2
    through = _transmittance(bricks, cells_zyx, chord, share)
    ahead = at[..., None]
    apart = beside[0][:, None] * (1 - ahead) + beside[1][:, None] * ahead
    width = np.zeros_like(chord) if one_ray else np.linalg.norm(apart, axis=-1)
    losses = [_losses(bricks, level, cells_zyx, chord, share, through, width) for level in range(bricks.coarsest)]
    cover = np.where(chord > 0, bricks.records[0]["cover"].ravel()[cells] / 255, 0.0).max(axis=1)
    return ViewLoss(cells, np.array(losses).reshape(bricks.coarsest, *cells.shape), float(cover.sum()))


def _ends(
    box_from_clip: Float64Array, shape_hw: tuple[int, int]
) -> tuple[Float64Array, Float64Array, tuple[Float64Array, Float64Array]]:
    """Return the ends of rays on the near and the far plane [ray, xyz], and the distance to the pixel beside there."""
    across = (np.arange(RAYS) + 0.5) / RAYS * 2 - 1
    y, x = (value.ravel() for value in np.meshgrid(-across, across, indexing="ij"))

    def plane(depth: float, aside: float = 0.0) -> Float64Array:
        clip = np.stack([x + aside, y, np.full_like(x, depth), np.ones_like(x)])
        found = box_from_clip @ clip
        ends: Float64Array = (found[:3] / found[3]).T
        return ends

    near, far = plane(-1.0), plane(1.0)
    pixel = 2 / shape_hw[1]
    return near, far, (plane(-1.0, pixel) - near, plane(1.0, pixel) - far)


def _segments(bricks: BrickFile, near: Float64Array, ray: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return where each ray enters the cells that it meets, and how far it goes in them, as shares of the ray.

    Rays that meet fewer cells than others have segments of no length.
    """
    extent = np.array(bricks.grid.extent_mm_zyx[::-1])
    safe = np.where(np.abs(ray) < 1e-12, 1e-12, ray)
    ends = np.sort(np.stack([-near / safe, (extent - near) / safe]), axis=0)
    enter, leave = np.clip(ends[0].max(axis=1), 0.0, 1.0), np.clip(ends[1].min(axis=1), 0.0, 1.0)
    planes = []
    for axis in range(3):
        n, h = bricks.records[0].shape[2 - axis], bricks.grid.spacing_mm_zyx[2 - axis]
        at = np.arange(1, n) * (bricks.layout.size * h)
        planes.append((at[None] - near[:, axis, None]) / safe[:, axis, None])
    bounds = np.concatenate([enter[:, None], *planes, leave[:, None]], axis=1)
    bounds = np.sort(np.clip(bounds, enter[:, None], np.maximum(leave, enter)[:, None]), axis=1)
    return bounds[:, :-1], np.diff(bounds, axis=1)


def _cells(bricks: BrickFile, places_mm: Float64Array) -> tuple[NDArray[np.intp], ...]:
    shape = bricks.records[0].shape
    edges = [bricks.layout.size * h for h in bricks.grid.spacing_mm_zyx]
    return tuple(
        np.clip((places_mm[..., 2 - axis] / edges[axis]).astype(np.intp), 0, shape[axis] - 1) for axis in range(3)
    )


def _transmittance(
    bricks: BrickFile, cells_zyx: tuple[NDArray[np.intp], ...], chord: Float64Array, share: Float64Array
) -> Float64Array:
    """Return the light [ray, segment] that goes through all cells before, from their mean opacities along the axes."""
    opacity = bricks.records[0]["opacity_xyz"][cells_zyx] / 255
    per_mm = np.zeros_like(chord)
    for axis in range(3):
        edge = bricks.edges_mm(0, 2 - axis)[cells_zyx[2 - axis]]
        per_mm += share[:, axis, None] * -np.log1p(-np.minimum(opacity[..., axis], 0.999)) / edge
    depth = np.cumsum(per_mm * chord, axis=1)
    through: Float64Array = np.exp(-np.concatenate([np.zeros((len(depth), 1)), depth[:, :-1]], axis=1))
    return through


def _losses(  # noqa: PLR0917 - a level, and rays through the cells
    bricks: BrickFile,
    level: int,
    cells_zyx: tuple[NDArray[np.intp], ...],
    chord: Float64Array,
    share: Float64Array,
    through: Float64Array,
    width_mm: Float64Array,
) -> Float64Array:
    """Return the loss [ray, segment] of a level against the next one."""
    factors = bricks.layout.factors_zyx[level]
    place = tuple(at // factor for at, factor in zip(cells_zyx, factors, strict=True))
    number = np.ravel_multi_index(place, bricks.records[level].shape)
    # Light is counted where a ray enters the brick: the loss holds the part that a brick hides of itself.
    starts = np.concatenate([np.ones((len(number), 1), bool), number[:, 1:] != number[:, :-1]], axis=1)
    entered = np.maximum.accumulate(np.where(starts, np.arange(number.shape[1]), 0), axis=1)
    reaching = np.take_along_axis(through, entered, axis=1)
    per_edge = sum(share[:, axis, None] / bricks.edges_mm(level, 2 - axis)[place[2 - axis]] for axis in range(3))
    voxel = min(f * h for f, h in zip(factors, bricks.grid.spacing_mm_zyx, strict=True))
    footprint = np.clip(np.log2(np.maximum(width_mm / voxel, 1.0)).astype(np.intp), 0, len(LOSS_FOOTPRINTS) - 1)
    records = bricks.records[level]["loss"].reshape(-1, len(LOSS_FOOTPRINTS))
    loss: Float64Array = records[number, footprint].astype(np.float64) * reaching * chord * per_edge
    # A brick of one value is there without being fetched.
    loss[bricks.records[level]["size_bytes"].ravel()[number] == 0] = 0.0
    return loss
