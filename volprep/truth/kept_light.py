"""Kept light: how much of the truth's light each thin or small thing of a picture keeps; 1 if all of it is there.

A vessel that covers a thousandth of a picture may vanish, and no mean over the picture changes. It is therefore
measured by itself:

1. A *signal* of a picture (signals.py) is its brightness, or a difference of its colours; things may be above or below
   their surroundings. What follows is of one signal, and of its negative.
2. A *thing* is a connected part of the truth (8 neighbours) that a morphological opening with a disk removes. The
   diameter of the disk is the width, two voxels of the level, and 3 pixels at least. It consists of pixels that are
   above the opening by more than 0.02, and by more than twice the median of matter; by 0.05 in the mean. A quarter of
   its light must *stand out*: it remains where each pixel of the opening first takes the value of its highest
   neighbour, but no more than the truth has. The corners of a rough outline do not stand out from their body, which a
   disk cannot fill; a vessel with a darker pixel on both sides does. It is *thin* if it is at least twice as long as
   the width; otherwise it is *small*.
3. Its *light* is the sum of what the opening removes. Small things have that of two pixels at least.
4. Things that are small, dark or of another colour are three times as far above the opening as other matter within four
   widths is in the mean: grains of noise are not, a fracture line and a lesion are. Matter is where the opening of the
   opacity shows something. Small things do not lie on an outline.
5. Its *surroundings* are the pixels that are nearer to it than to other things, no further away than the width.
6. *Kept light* is 1 plus the weighted sum of (picture - truth), divided by that of what the opening removes. A coarse
   level may spread the light over the surroundings, which all weigh 1. The finest level may not: the thing's
   own pixels alone weigh, by what the opening removes, so that a third of a step of 8 bits all around is no loss. The
   difference of the background is subtracted first: a line of least squares over the opening, through the pixels
   outside all surroundings within three widths. A body that a level makes darker then takes nothing from a vessel in
   the empty air beside it, as the mean of the background does.
7. It is *uncertain* by the scatter of the background's differences about that line, taken as independent in patches of
   the width squared, with the same weights and divisor. Where a thing lies on a body that is
   brighter than all background near it, the line does not cover this body: its excess brightness counts times the mean
   change of the whole picture. Lines on a lit head, which are a tenth of its light, had no other background than air.

A picture that spreads a vessel's light over two voxels keeps 1, one that has lost the vessel 0. If the opacity is near
1, spreading makes more light: then more than 1 is kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep.truth.metrics import part_around, require_same_shape
from volprep.truth.opening import disk_of, opened
from volprep.truth.signals import Signal, signals_of
from volprep_formats.arrays import Float32Array, Float64Array, FloatArray

LEAST_CONTRAST = 0.02
"""Contrast of each pixel to the opening, premultiplied linear."""
LEAST_MEAN_CONTRAST = 0.05
"""Mean contrast to the opening. Fainter things are mostly noise: how a level shows them means little."""
_LEAST_STANDING = 0.25
"""Part of a thing's light. Chains of corners on outlines of four scans have 0.02 to 0.17. Lost and faded vessels,
struts, shells and slabs between cracks are found as without this limit up to 0.25; with 0.33 of 642 pictures 3 are not.
"""
_LEAST_SMALL_LIGHT = 2.0
"""Pixels of full contrast. What the rounding of a target and an RMSE of 0.01 make of a smaller thing is a tenth."""
_OVER_NOISE = 3.0
"""Mean contrast over that of what is seen near."""
_EVEN = 2.0
"""Mean contrasts of a small thing that the opening may change by around it: on an outline it changes by more."""
_OVER_GRAIN = 2.0
"""Contrast of each pixel over the median of matter, whose noise would join things to a web."""
_NEAR = 4.0
"""Widths within which noise counts."""
LEAST_WIDTH = 3.0
"""Pixels. A thinner disk removes nothing but single pixels."""
_FINE = 5.0
"""Pixels of a width that are enough: larger pictures are averaged down to it first."""
_AROUND = 3.0
"""Widths within which the background counts."""
_REACH = 1.0
"""Standard deviations of the background's brightness up to which its line is drawn. Where the background is one small
blob, a line without an end gave a thing 5 times its light."""


@dataclass(frozen=True)
class SmallThing:
    """A thin or small thing of the truth, and the part of it that a picture keeps."""

    rows: tuple[int, int]
    """First pixel row, and the row after its last."""
    columns: tuple[int, int]
    """First pixel column, and the column after its last."""
    signal: Signal
    """Signal in which it differs from its surroundings."""
    is_thin: bool
    """Whether it is at least twice as long as the width."""
    light: float
    """The truth's light of it: contrast to the surroundings, summed over pixels."""
    kept: float
    """Part of that light that the picture has; 1 if right, below 0 if its surroundings have become darker."""
    within: float
    """Uncertainty of `kept`: from the scatter of the background's differences."""

    @property
    def kept_at_most(self) -> float:
        """Most light that it may have kept, given the uncertainty."""
        return self.kept + self.within


def small_things(
    picture: FloatArray, truth: FloatArray, width_pixels: float, *, spreads: bool = False, lit: bool = False
) -> tuple[SmallThing, ...]:
    """Return the things of `truth` with the light that `picture` keeps of each, the least kept first.

    Both pictures are [H, W, 4], premultiplied linear RGB and alpha. `width_pixels` is the width of two voxels of the
    level in pixels. With `spreads`, for coarse levels, light may move to the surroundings. With `lit`, shades of one
    colour are no contrast. Raises ValueError if the shapes differ.
    """
    require_same_shape(picture, truth)
    scale = max(1, int(width_pixels / _FINE))
    width = max(LEAST_WIDTH, width_pixels / scale)
    fewer, other = _reduced(truth, scale), _reduced(picture, scale)
    shown = (fewer != 0.0).any(axis=-1) | (other != 0.0).any(axis=-1)
    if not shown.any():
        return ()
    # Surroundings reach one width, their background _AROUND further, and the scatter of that as far again.
    part = part_around(shown, math.ceil((1.0 + 2.0 * _AROUND) * width) + 2)
    fewer, other = fewer[part], other[part]
    matter = matter_of(fewer, width)
    pairs = zip(signals_of(fewer, lit=lit), signals_of(other, lit=lit), strict=True)
    found = [
        thing
        for (signal, high), (_, drawn) in pairs
        if np.ptp(high) >= LEAST_MEAN_CONTRAST
        for thing in _of_signal(signal, high, drawn - high, matter, width, scale, spreads=spreads)
    ]
    corner = tuple(side.start * scale for side in part)
    return tuple(sorted((_moved(thing, *corner) for thing in found), key=lambda thing: thing.kept))


def _moved(thing: SmallThing, down: int, right: int) -> SmallThing:
    rows, columns = ((first + by, end + by) for (first, end), by in ((thing.rows, down), (thing.columns, right)))
    return replace(thing, rows=rows, columns=columns)


def _of_signal(  # noqa: PLR0917 - a signal, and its pixels
    signal: Signal,
    high: Float32Array,
    difference: Float32Array,
    matter: NDArray[np.bool_],
    width: float,
    scale: int,
    *,
    spreads: bool,
) -> list[SmallThing]:
    """Return the things of which the signal `high` of the truth is above its surroundings."""
    found = things_of(high, matter, width, signal)
    if found is None:
        return []
    labels, removed = found
    near = surroundings_of(labels, width)
    background, scatter, unknown = _background(difference, high - removed, near == 0, width)
    count = int(labels.max()) + 1
    of, weights = (near, np.float32(1.0)) if spreads else (labels, removed)

    def total(values: FloatArray, where: NDArray[np.intp] = of) -> Float64Array:
        return np.bincount(where.ravel(), values.ravel(), count)[1:].astype(np.float64)

    weighed = total(weights * removed, labels)
    mean_change = float(np.abs(difference).sum() / np.abs(high).sum())
    within = np.hypot(width * np.sqrt(total((weights * scatter) ** 2)), mean_change * total(weights * unknown))
    change, light = total(weights * (difference - background)), total(removed, labels)
    return [
        SmallThing(
            rows=(rows.start * scale, rows.stop * scale),
            columns=(columns.start * scale, columns.stop * scale),
            signal=signal,
            is_thin=_length((rows, columns)) >= 2 * width,
            light=float(light[index]) * scale**2,
            kept=1.0 + float(change[index] / weighed[index]),
            within=float(within[index] / weighed[index]),
        )
        for index, (rows, columns) in enumerate(_boxes(labels))
    ]


def least_kept(things: Sequence[SmallThing]) -> float | None:
    """Return the kept light of the thing that keeps the least; None without any."""
    return min((thing.kept for thing in things), default=None)


def kept_at_most(things: Sequence[SmallThing]) -> float | None:
    """Return the most light that every thing may have kept, given the uncertainty; None without any."""
    return min((thing.kept_at_most for thing in things), default=None)


def lost_things(things: Sequence[SmallThing], least: float) -> tuple[SmallThing, ...]:
    """Return the things that surely keep less than `least`, the least kept first, each once.

    A thing may be found in several signals: those that overlap count as one.
    """
    lost: list[SmallThing] = []
    for thing in things:
        if thing.kept_at_most < least and not any(_overlap(thing, other) for other in lost):
            lost.append(thing)
    return tuple(lost)


def _overlap(one: SmallThing, other: SmallThing) -> bool:
    sides = ((one.rows, other.rows), (one.columns, other.columns))
    return all(a[0] < b[1] and b[0] < a[1] for a, b in sides)


def _reduced(picture: FloatArray, scale: int) -> Float32Array:
    """Return the means of blocks of scale × scale pixels; incomplete blocks at the ends are cut off."""
    height, width = (n // scale for n in picture.shape[:2])
    blocks = picture[: height * scale, : width * scale].reshape(height, scale, width, scale, -1)
    means: Float32Array = blocks.mean(axis=(1, 3), dtype=np.float32)
    return means


def matter_of(picture: FloatArray, width: float) -> NDArray[np.bool_]:
    """Return where the opening of the opacity of a picture [H, W, 4] shows something."""
    matter: NDArray[np.bool_] = opened(picture[..., 3], disk_of(width)) > LEAST_CONTRAST
    return matter


def things_of(
    high: Float32Array, matter: NDArray[np.bool_], width: float, signal: Signal
) -> tuple[NDArray[np.intp], Float32Array] | None:
    """Return a label per pixel of a thing, 0 elsewhere, and the light that the opening removes; None if empty."""
    removed = high - opened(high, disk_of(width))
    if removed.max() < LEAST_MEAN_CONTRAST:
        return None
    from scipy import ndimage  # noqa: PLC0415 - heavy

    grain = float(np.median(removed[matter])) if matter.any() else 0.0
    labels, _ = ndimage.label(removed > max(LEAST_CONTRAST, _OVER_GRAIN * grain), np.ones((3, 3)))
    light = np.bincount(labels.ravel(), removed.ravel())[1:]
    means = light / np.bincount(labels.ravel())[1:]
    counts = means >= LEAST_MEAN_CONTRAST
    boxes = ndimage.find_objects(labels)
    is_thin = np.array([counts[k] and _length(box) >= 2 * width for k, box in enumerate(boxes)], np.bool_)
    counts &= is_thin | (light >= _LEAST_SMALL_LIGHT)
    if not counts.any():
        return None
    ground = high - removed
    standing = high - np.minimum(ndimage.grey_dilation(ground, size=(3, 3)), high)
    counts &= np.bincount(labels.ravel(), standing.ravel())[1:] >= _LEAST_STANDING * light
    for k in np.flatnonzero(counts & ~(is_thin & (signal == "bright"))):
        is_even = is_thin[k] or np.ptp(ground[_around(boxes[k], 1)]) <= _EVEN * means[k]
        noise = _noise(removed, matter & (labels != k + 1), _around(boxes[k], round(_NEAR * width)))
        counts[k] = is_even and means[k] >= _OVER_NOISE * noise
    if not counts.any():
        return None
    kept = np.concatenate([[0], counts]).astype(np.intp)
    numbered: NDArray[np.intp] = np.cumsum(kept) * kept
    return numbered[labels], removed


def _around(box: tuple[slice, ...], margin: int) -> tuple[slice, ...]:
    return tuple(slice(max(0, side.start - margin), side.stop + margin) for side in box)


def _noise(removed: Float32Array, others: NDArray[np.bool_], near: tuple[slice, ...]) -> float:
    """Return the mean of what the opening removes from `others`, pixels of other matter, near a thing."""
    return float(removed[near][others[near]].mean()) if others[near].any() else 0.0


def surroundings_of(labels: NDArray[np.intp], width: float) -> NDArray[np.intp]:
    """Return the label of the nearest thing for each pixel that is no further from it than the width, 0 elsewhere."""
    from scipy import ndimage  # noqa: PLC0415 - heavy

    distance, nearest = ndimage.distance_transform_edt(labels == 0, return_indices=True)
    near: NDArray[np.intp] = np.where(distance <= width, labels[tuple(nearest)], 0)
    return near


def _background(
    difference: Float32Array, opening: Float32Array, outside: NDArray[np.bool_], width: float
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the difference of a background as bright as `opening` near each pixel, and its scatter; 0 if none is near.

    Where the background is even, `opening` changing by less than the least contrast, this is its mean. The third
    picture is the brightness that is beyond the reach of the line.
    """
    from scipy import ndimage  # noqa: PLC0415 - heavy

    size = 2 * round(_AROUND * width) + 1
    ground, change = opening.astype(np.float64), difference.astype(np.float64)
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


def _length(box: tuple[slice, ...]) -> int:
    return max(int(side.stop) - int(side.start) for side in box)
