"""The picture that a scan with segments should give, in float64, with a bound on its own error.

The weight of a label at a point is the sum of the trilinear weights of the voxels, of the eight around it, that have
the label; weights are at least 0 and sum to 1. Each label has a look: a transfer function over the scan's values, or
none where it is hidden. With *mixed* borders colour times extinction, and extinction, are sums over the labels' looks,
times their weights. With *crisp* borders the look of the label with the greatest weight gives both; at a tie the
smaller label counts. The native oracle (native/src/oracle_labels.cpp) integrates both exactly.

Where it is lit, a normal is the slope of the value, as a part of the range of codes per millimetre. In cells whose
voxels differ in visible extinction, taken at the value of the place, the gradient of its logarithm is added: of the
field in which voxels have the weights of quadratic B-splines (native/src/oracle_labels_lit.cpp).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.truth.lit import Lit, Normals, ShaderSlopes, light_numbers, shadow_light
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture, function_rows
from volprep.truth.volume import Volume, require_field
from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

Border = Literal["mixed", "crisp"]
"""How labels meet between voxels."""
_NOTHING = np.zeros((1, 5))


@dataclass(frozen=True)
class Labelled:
    """The labels of a scan, and how each looks."""

    labels: NDArray[np.uint16]
    """[z, y, x], on the grid of the scan."""
    looks: tuple[TransferFunction | None, ...]
    """For each label from 0: its look, a function of the scan's values; None if it is hidden."""
    border: Border = "mixed"
    """How labels meet between voxels."""


def tinted(function: TransferFunction, tint: tuple[float, float, float], opacity: float = 1.0) -> TransferFunction:
    """Return a transfer function with its linear colours multiplied by `tint` and its extinction by `opacity`."""
    points = tuple(
        TransferPoint(
            value=point.value,
            colour=tuple(part * factor for part, factor in zip(point.colour, tint, strict=True)),
            extinction_per_mm=point.extinction_per_mm * opacity,
        )
        for point in function.points
    )
    return function.model_copy(update={"points": points})


def labelled_picture(
    volume: Volume,
    labelled: Labelled,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
) -> OraclePicture:
    """Draw a scan with segments, with a bound on the error of each pixel; arguments and errors as `oracle_picture`.

    Labels with the same look are one: dividing a label changes nothing. Lit, with slopes as a shader takes them, the
    bound is an estimate. Raises ValueError for other normals.
    """
    grid, normals = volume.grid, volume.normals
    require_field(volume.stored, grid)
    kernel, slope_scale, border_scale = _slopes(normals, volume.slope)
    rows, looks = _distinct(labelled.looks)
    picture = OraclePicture(rgba=np.empty((*shape_hw, 4)), bound=np.empty(shape_hw))
    _native.render_oracle_labels(
        volume.stored,
        volume.slope,
        volume.intercept,
        np.ascontiguousarray(labelled.labels, np.uint16),
        looks,
        rows or [_NOTHING],
        labelled.border == "crisp",
        grid.spacing_mm_zyx[::-1],
        grid.extent_mm_zyx[::-1],
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        tolerance,
        picture.rgba,
        picture.bound,
        kernel,
        slope_scale,
        border_scale,
        light_numbers(normals, grid),
        isinstance(normals, Lit) and normals.halfway,
        shadow_light(normals) is not None,
    )
    return picture


def _slopes(normals: Normals, slope: float) -> tuple[str, float, float]:
    """Return kernel and scale of the slopes of values, and what 1 per millimetre of a border counts beside them."""
    if normals is None:
        return "", 0.0, 0.0
    slopes = normals.normals if isinstance(normals, Lit) else None
    if not isinstance(slopes, ShaderSlopes):
        msg = "segments are lit by slopes as a shader takes them"
        raise ValueError(msg)  # noqa: TRY004 - as documented
    # Values that fall as stored values rise turn the slope, which borders are added to.
    return slopes.kernel, math.copysign(slopes.scale(slope), slope), slopes.border_scale


def _distinct(looks: Sequence[TransferFunction | None]) -> tuple[list[Float64Array], NDArray[np.int32]]:
    """Return the control points of the different looks, and for each label its look, -1 if hidden."""
    found: dict[bytes, int] = {}
    rows: list[Float64Array] = []
    places = np.full(len(looks), -1, np.int32)
    for label, look in enumerate(looks):
        if look is None:
            continue
        points = function_rows(look)
        key = points.tobytes()
        if key not in found:
            found[key] = len(rows)
            rows.append(points)
        places[label] = found[key]
    return rows, places
