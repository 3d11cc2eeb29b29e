"""The picture of a scan with segments where a ray shows one value: a maximum or a first hit, in float64.

1. Voxels of hidden labels count as less than any other: a sixteenth of the range of stored values below the least one.
   The value of a ray, and its place, follow `volprep.truth.projection` and `volprep.truth.surface` in the field
   of these voxels. Of maxima that differ by at most 1/512 of the range the first counts. A maximum more than halfway
   below the least value is not shown.
2. The look of the place comes from the shown labels of the eight voxels around it. With *mixed* borders extinction, and
   colour times extinction, are the means of what their looks make of the value, by the trilinear weights of their
   voxels. With *crisp* borders the look of the label with the greatest weight counts; of
   weights that differ by less than 1/512 that of the smallest label.
3. Opacity is that of the reference length.

A bound covers the rounding of a hit. How a look changes within the rounding of a place is not part of it.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.truth.labelled import Labelled
from volprep.truth.oracle import OraclePicture
from volprep.truth.projection import projected_values
from volprep.truth.surface import Hits, directions, light_hits, near_ends, surface_hits
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.segments.record import HIDDEN_BELOW, SAME
from volprep_formats.package.transfer_function import TransferFunction

OneValue = Literal["maximum", "first-hit"]
"""Value of a ray that is shown."""
_ROUNDING = 1e-9


def labelled_value_picture(  # noqa: PLR0917 - as labelled_picture, the value, and the window
    shown: OneValue,
    volume: Volume,
    window: tuple[float, float],
    labelled: Labelled,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
) -> OraclePicture:
    """Draw one value of each ray through a scan with segments, with a bound on the error of each pixel.

    `window` has the least and the greatest physical value that the package stores. Isovalue and reference length come
    from the looks, which agree. Other arguments and errors as in `labelled_picture`.
    """
    looks = [look for look in labelled.looks if look is not None]
    picture = OraclePicture(rgba=np.zeros((*shape_hw, 4)), bound=np.zeros(shape_hw))
    if not looks:
        return picture
    is_shown = np.array([look is not None for look in labelled.looks])[labelled.labels]
    below = HIDDEN_BELOW * (window[1] - window[0])
    physical = volume.slope * volume.stored.astype(np.float64) + volume.intercept
    stored: Float32Array = np.where(is_shown, physical, window[0] - below).astype(np.float32)
    field = replace(volume, stored=stored, slope=1.0, intercept=0.0)
    hits = _hits(shown, field, looks[0], box_from_clip, shape_hw, SAME * (window[1] - window[0]))
    met = hits.value > window[0] - 0.5 * below
    places = near_ends(box_from_clip, shape_hw) + np.nan_to_num(hits.t_mm)[..., None] * directions(
        box_from_clip, shape_hw
    )
    voxels = places[met] / volume.grid.spacing_mm_zyx[::-1] - 0.5
    medium = _medium(hits.value[met], *_corners(voxels[:, ::-1], labelled.labels), labelled)
    opacity = -np.expm1(-medium[:, 3:] * looks[0].reference_mm)
    picture.rgba[met] = np.concatenate([medium[:, :3] * opacity, opacity], axis=1)
    picture.bound[met] = _ROUNDING
    if shown == "first-hit":
        light_hits(picture, hits, volume, box_from_clip)
    return picture


def _hits(  # noqa: PLR0917 - the field, then the view
    shown: OneValue,
    field: Volume,
    look: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tie: float,
) -> Hits:
    """Return value and place of each ray. Raises ValueError for a first hit without an isovalue."""
    if shown == "first-hit":
        if look.isovalue is None:
            msg = "a first hit needs an isovalue"
            raise ValueError(msg)
        return surface_hits(field, look.isovalue, box_from_clip, shape_hw, solid=True)
    t_mm = np.empty(shape_hw)
    value, error = projected_values("maximum", field, box_from_clip, shape_hw, t_mm=t_mm, tie=tie)
    nothing = np.zeros(shape_hw)
    return Hits(t_mm, error, value, np.zeros((*shape_hw, 3)), nothing, nothing + 1.0)


def _corners(voxels_zyx: Float64Array, labels: NDArray[np.uint16]) -> tuple[NDArray[np.uint16], Float64Array]:
    """Return labels and trilinear weights [place, 8] of the voxels around places, in voxels."""
    first = np.floor(voxels_zyx)
    share = voxels_zyx - first
    corners = np.stack(np.meshgrid(*([(0, 1)] * 3), indexing="ij"), axis=-1).reshape(8, 3)
    weights: Float64Array = np.where(corners, share[:, None], 1.0 - share[:, None]).prod(axis=-1)
    at = np.clip(first[:, None].astype(np.intp) + corners, 0, np.array(labels.shape) - 1)
    return labels[at[..., 0], at[..., 1], at[..., 2]], weights


def _medium(
    values: Float64Array, labels: NDArray[np.uint16], weights: Float64Array, labelled: Labelled
) -> Float64Array:
    """Return linear colour and extinction [place, 4] of values."""
    present = [label for label in np.unique(labels) if labelled.looks[label] is not None]
    shares = [(weights * (labels == label)).sum(axis=1) for label in present]
    if not present:
        return np.zeros((len(values), 4))
    share = np.array(shares)
    if labelled.border == "crisp":
        # argmax takes the first of equal ones, which is the smallest label.
        chosen = (share > share.max(axis=0) - SAME).argmax(axis=0)
        share = (np.arange(len(present))[:, None] == chosen) * (share > 0.0)
    total = np.zeros((len(values), 4))
    for label, part in zip(present, share, strict=True):
        look = labelled.looks[label]
        assert look is not None  # noqa: S101 - only shown labels are present
        table = Table.exact(look)
        extinction = part * np.interp(values, table.values, table.extinction_per_mm)
        colour = np.stack([np.interp(values, table.values, channel) for channel in table.colour.T], axis=-1)
        total += np.column_stack([colour * extinction[:, None], extinction])
    all_shares = share.sum(axis=0)
    colour = total[:, :3] / np.maximum(total[:, 3:], 1e-30)
    extinction = total[:, 3:] / np.where(all_shares > 0.0, all_shares, 1.0)[:, None]
    return np.concatenate([colour, extinction], axis=1)
