"""Kept light: how much of the truth's light each thin thing of a picture keeps; 1 if all of it is there.

A vessel that covers a thousandth of a picture may vanish, and no mean over the picture changes. It is therefore
measured by itself:

1. *Brightness* of a pixel is the mean of its four premultiplied channels.
2. A *thin thing* is a connected part of the truth (8 neighbours) that a morphological opening with a disk removes. The
   diameter of the disk is the width, two voxels of the level, and 3 pixels at least. It consists of pixels that are
   brighter than the opening by more than 0.02, by 0.05 in the mean, and is at least twice as long as the width. A
   quarter of its light must *stand out*: it remains where each pixel of the opening first takes the brightness of its
   brightest neighbour, but no more than the truth has. The corners of a rough outline do not stand out from their body,
   which a disk cannot fill; a vessel with a darker pixel on both sides does.
3. Its *light* is the sum of what the opening removes.
4. Its *surroundings* are the pixels that are nearer to it than to other thin things, no further away than the width: a
   level may spread the light over so much.
5. *Kept light* is 1 plus the sum of (picture - truth) over the surroundings, divided by the light. The difference of
   the background is subtracted first: a line of least squares over the brightness of the opening, through the pixels
   outside all surroundings within three widths. A body that a level makes darker then takes nothing from a vessel in
   the empty air beside it, as the mean of the background does.
6. It is *uncertain* by the scatter of the background's differences about that line, taken as independent in patches of
   the width squared, summed over the surroundings and divided by the light. Where a thing lies on a body that is
   brighter than all background near it, the line does not cover this body: its excess brightness counts times the mean
   change of the whole picture. Lines on a lit head, which are a tenth of its light, had no other background than air.

A picture that spreads a vessel's light over two voxels keeps 1, one that has lost the vessel 0. If the opacity is near
1, spreading makes more light: then more than 1 is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.truth.metrics import require_same_shape
from volprep_formats.arrays import Float32Array, Float64Array, FloatArray

LEAST_CONTRAST = 0.02
"""Brightness of each pixel above the opening, premultiplied linear."""
LEAST_MEAN_CONTRAST = 0.05
"""Mean brightness above the opening. Fainter things are mostly noise: how a level shows them means little."""
_LEAST_STANDING = 0.25
"""Part of a thing's light. Chains of corners on outlines of four scans have 0.02 to 0.17. Lost and faded vessels,
struts, shells and slabs between cracks are found as without this limit up to 0.25; with 0.33 of 642 pictures 3 are not.
"""
_LEAST_WIDTH = 3.0
"""Pixels. A thinner disk removes nothing but single pixels."""
_FINE = 5.0
"""Pixels of a width that are enough: larger pictures are averaged down to it first."""
_AROUND = 3.0
"""Widths within which the background counts."""
_REACH = 1.0
"""Standard deviations of the background's brightness up to which its line is drawn. Where the background is one small
blob, a line without an end gave a thing 5 times its light."""


@dataclass(frozen=True)
class ThinThing:
    """A thin thing of the truth, and the part of it that a picture keeps."""

    rows: tuple[int, int]
    """First pixel row, and the row after its last."""
    columns: tuple[int, int]
    """First pixel column, and the column after its last."""
    light: float
    """The truth's light of it: brightness above the surroundings, summed over pixels."""
    kept: float
    """Part of that light that the picture has; 1 if right, below 0 if its surroundings have become darker."""
    within: float
    """Uncertainty of `kept`: from the scatter of the background's differences."""


def thin_things(picture: FloatArray, truth: FloatArray, width_pixels: float) -> tuple[ThinThing, ...]:
    """Return the thin things of `truth` with the light that `picture` keeps of each, the least kept first.

    Both pictures are [H, W, 4], premultiplied linear RGB and alpha. `width_pixels` is the width of two voxels of the
    level in pixels. Raises ValueError if the shapes differ.
    """
    require_same_shape(picture, truth)
    scale = max(1, int(width_pixels / _FINE))
    width = max(_LEAST_WIDTH, width_pixels / scale)
    bright = _reduced(truth, scale)
    difference = _reduced(picture, scale) - bright
    found = _things(bright, width)
    if found is None:
        return ()
    labels, removed = found
    near = _surroundings(labels, width)
    background, scatter, unknown = _background(difference, bright - removed, near == 0, width)
    count = int(labels.max()) + 1
    light = np.bincount(labels.ravel(), removed.ravel(), count)[1:]
    change, variance, brighter = (
        np.bincount(near.ravel(), each.ravel(), count)[1:] for each in (difference - background, scatter**2, unknown)
    )
    mean_change = float(np.abs(difference).sum() / bright.sum())
    within = np.hypot(width * np.sqrt(variance), mean_change * brighter)
    things = [
        ThinThing(
            rows=(rows.start * scale, rows.stop * scale),
            columns=(columns.start * scale, columns.stop * scale),
            light=float(light[index]) * scale**2,
            kept=1.0 + float(change[index] / light[index]),
            within=float(within[index] / light[index]),
        )
        for index, (rows, columns) in enumerate(_boxes(labels))
    ]
    return tuple(sorted(things, key=lambda thing: thing.kept))


def least_kept(things: Sequence[ThinThing]) -> float:
    """Return the kept light of the thin thing that keeps the least; 1 without any."""
    return min((thing.kept for thing in things), default=1.0)


def kept_at_most(things: Sequence[ThinThing]) -> float:
    """Return the most light that every thin thing may have kept, given the uncertainty; 1 without any."""
    return min((thing.kept + thing.within for thing in things), default=1.0)


def _reduced(picture: FloatArray, scale: int) -> Float32Array:
    """Return the brightness of blocks of scale × scale pixels; incomplete blocks at the ends are cut off."""
    bright = np.asarray(picture, np.float32).mean(axis=-1, dtype=np.float32)
    height, width = (n // scale for n in bright.shape)
    blocks = bright[: height * scale, : width * scale].reshape(height, scale, width, scale)
    means: Float32Array = blocks.mean(axis=(1, 3), dtype=np.float32)
    return means


def _things(bright: Float32Array, width: float) -> tuple[NDArray[np.intp], Float32Array] | None:
    """Return a label per pixel of a thin thing, 0 elsewhere, and the light that the opening removes; None if empty."""
    from scipy import ndimage  # noqa: PLC0415 - heavy

    removed = bright - ndimage.grey_opening(bright, footprint=_disk(width))
    labels, count = ndimage.label(removed > LEAST_CONTRAST, np.ones((3, 3)))
    if count == 0:
        return None
    lengths = [max(side.stop - side.start for side in box) for box in ndimage.find_objects(labels)]
    means = ndimage.mean(removed, labels, np.arange(1, count + 1))
    opened = bright - removed
    standing = bright - np.minimum(ndimage.grey_dilation(opened, size=(3, 3)), bright)
    shares = ndimage.mean(standing, labels, np.arange(1, count + 1)) / means
    counts = (
        (np.array(lengths) >= 2 * width)
        & (np.asarray(means) >= LEAST_MEAN_CONTRAST)
        & (np.asarray(shares) >= _LEAST_STANDING)
    )
    if not counts.any():
        return None
    kept = np.concatenate([[0], counts]).astype(np.intp)
    numbered: NDArray[np.intp] = np.cumsum(kept) * kept
    return numbered[labels], removed


def _surroundings(labels: NDArray[np.intp], width: float) -> NDArray[np.intp]:
    """Return the label of the nearest thing for each pixel that is no further from it than the width, 0 elsewhere."""
    from scipy import ndimage  # noqa: PLC0415 - heavy

    distance, nearest = ndimage.distance_transform_edt(labels == 0, return_indices=True)
    near: NDArray[np.intp] = np.where(distance <= width, labels[tuple(nearest)], 0)
    return near


def _background(
    difference: Float32Array, opened: Float32Array, outside: NDArray[np.bool_], width: float
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the difference of a background as bright as `opened` near each pixel, and its scatter; 0 if none is near.

    Where the background is even, `opened` changing by less than the least contrast, this is its mean. The third picture
    is the brightness that is beyond the reach of the line.
    """
    from scipy import ndimage  # noqa: PLC0415 - heavy

    size = 2 * round(_AROUND * width) + 1
    ground, change = opened.astype(np.float64), difference.astype(np.float64)
    share = ndimage.uniform_filter(outside.astype(np.float64), size, mode="constant")
    share = np.where(share > 0.5 / size**2, share, np.inf)

    def mean(values: Float64Array) -> Float64Array:
        found: Float64Array = ndimage.uniform_filter(np.where(outside, values, 0.0), size, mode="constant") / share
        return found

    middle, level = mean(ground), mean(change)
    variance = np.maximum(mean(ground**2) - middle**2, 0.0)
    slope = (mean(ground * change) - middle * level) / (variance + LEAST_CONTRAST**2)
    reach = _REACH * np.sqrt(variance)
    aside = ground - middle
    line: Float64Array = level + slope * np.clip(aside, -reach, reach)
    scatter = np.sqrt(np.maximum(mean((change - line) ** 2), 0.0))
    return line, scatter, np.maximum(np.abs(aside) - reach, 0.0)


def _boxes(labels: NDArray[np.intp]) -> list[tuple[slice, slice]]:
    from scipy import ndimage  # noqa: PLC0415 - heavy

    return [(box[0], box[1]) for box in ndimage.find_objects(labels) if box is not None]


def _disk(diameter: float) -> NDArray[np.bool_]:
    """Return the disk whose widest row is the diameter in pixels, rounded."""
    pixels = round(diameter)
    places = np.arange(pixels) - (pixels - 1) / 2
    disk: NDArray[np.bool_] = np.hypot(*np.meshgrid(places, places)) <= pixels / 2
    return disk
