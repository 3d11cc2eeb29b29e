"""Kept light: how much of the truth's light each thin thing of a picture keeps; 1 if all of it is there.

A vessel that covers a thousandth of a picture may vanish, and no mean over the picture changes. It is therefore
measured by itself:

1. *Brightness* of a pixel is the mean of its four premultiplied channels.
2. A *thin thing* is a connected part of the truth (8 neighbours) that a morphological opening with a disk removes. The
   diameter of the disk is the width, two voxels of the level, and 3 pixels at least. It consists of pixels that are
   brighter than the opening by more than 0.02, by 0.05 in the mean, and is at least twice as long as the width.
3. Its *light* is the sum of what the opening removes.
4. Its *surroundings* are the pixels that are nearer to it than to other thin things, no further away than the width: a
   level may spread the light over so much.
5. *Kept light* is 1 plus the sum of (picture - truth) over the surroundings, divided by the light. The mean difference
   of the background, pixels outside all surroundings within three widths, is subtracted first.

A picture that spreads a vessel's light over two voxels keeps 1, one that has lost the vessel 0. If the opacity is near
1, spreading makes more light: then more than 1 is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.truth.metrics import require_same_shape
from volprep_formats.arrays import Float32Array, FloatArray

LEAST_CONTRAST = 0.02
"""Brightness of each pixel above the opening, premultiplied linear."""
LEAST_MEAN_CONTRAST = 0.05
"""Mean brightness above the opening. Fainter things are mostly noise: how a level shows them means little."""
_LEAST_WIDTH = 3.0
"""Pixels. A thinner disk removes nothing but single pixels."""
_FINE = 5.0
"""Pixels of a width that are enough: larger pictures are averaged down to it first."""
_AROUND = 3.0
"""Widths within which the background counts."""


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
    difference -= _background(difference, near == 0, width)
    numbers = np.arange(1, int(labels.max()) + 1)
    light = np.bincount(labels.ravel(), removed.ravel(), len(numbers) + 1)[1:]
    change = np.bincount(near.ravel(), difference.ravel(), len(numbers) + 1)[1:]
    things = [
        ThinThing(
            rows=(rows.start * scale, rows.stop * scale),
            columns=(columns.start * scale, columns.stop * scale),
            light=float(light[index]) * scale**2,
            kept=1.0 + float(change[index] / light[index]),
        )
        for index, (rows, columns) in enumerate(_boxes(labels))
    ]
    return tuple(sorted(things, key=lambda thing: thing.kept))


def least_kept(things: Sequence[ThinThing]) -> float:
    """Return the kept light of the thin thing that keeps the least; 1 without any."""
    return min((thing.kept for thing in things), default=1.0)


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
    counts = (np.array(lengths) >= 2 * width) & (np.asarray(means) >= LEAST_MEAN_CONTRAST)
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


def _background(difference: Float32Array, outside: NDArray[np.bool_], width: float) -> Float32Array:
    """Return the mean of `difference` over the pixels `outside` all surroundings near each pixel; 0 without any."""
    from scipy import ndimage  # noqa: PLC0415 - heavy

    size = 2 * round(_AROUND * width) + 1
    weight = ndimage.uniform_filter(outside.astype(np.float32), size, mode="constant")
    total = ndimage.uniform_filter(np.where(outside, difference, np.float32(0)), size, mode="constant")
    least = 0.5 / size**2
    means: Float32Array = np.where(weight > least, total / np.maximum(weight, least), 0).astype(np.float32)
    return means


def _boxes(labels: NDArray[np.intp]) -> list[tuple[slice, slice]]:
    from scipy import ndimage  # noqa: PLC0415 - heavy

    return [(box[0], box[1]) for box in ndimage.find_objects(labels) if box is not None]


def _disk(diameter: float) -> NDArray[np.bool_]:
    """Return the disk whose widest row is the diameter in pixels, rounded."""
    pixels = round(diameter)
    places = np.arange(pixels) - (pixels - 1) / 2
    disk: NDArray[np.bool_] = np.hypot(*np.meshgrid(places, places)) <= pixels / 2
    return disk
