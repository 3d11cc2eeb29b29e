"""The picture that a renderer should give, in float64, with a bound on its own error.

The oracle integrates along each pixel's ray the exact trilinear field of the voxels and the exact piecewise linear
transfer function (native/src/oracle*.cpp): rays are cut at every plane of voxel centres and wherever the field crosses
a control point, and each piece is integrated by a Gauss rule with a proven bound, also where it is lit. Splitting
rays like this was described by Weiss and Westermann (Differentiable Direct Volume Rendering and Ray Splitting,
EuroVis 2021).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.truth.lit import native_normals
from volprep.truth.volume import Medium, Volume, require_field
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid, Vector
from volprep_formats.package.transfer_function import TransferFunction

DEFAULT_TOLERANCE = 1e-6
"""A four-thousandth of one step of an 8-bit target, and about the noise of a renderer in float32."""


@dataclass(frozen=True)
class OraclePicture:
    """A picture, with a bound on its error."""

    rgba: Float64Array
    """[height, width, 4], row 0 on top: premultiplied linear RGB, and 1 - exp(-optical depth)."""
    bound: Float64Array
    """[height, width]: no channel of the pixel is further than this from the true integral."""


def oracle_picture(
    volume: Volume,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
) -> OraclePicture:
    """Draw a volume with a bound on the error of each pixel.

    The bound stays below `tolerance`, except where float64 is too coarse for the question: with tolerances below about
    1e-10 (1e-9 where colours are lit), for a ray inside a plateau that lies exactly on a jump of the transfer function,
    and for one within a face between two labels.

    Parameters
    ----------
    volume
        The field. If its values are labels (`nearest`), it is constant in each voxel, and each piece is exact. If it is
        lit, then from the viewer: its normals are the kernel whose gradients of the volume give them, in float64, or
        vectors [z, y, x, (x, y, z)] along the axes of the box. Between voxels vectors are interpolated; colours are
        multiplied by the absolute cosine between ray and vector, where this is longer than 0.01. Labels are not lit.
        A light with a place counts as the viewer here: `refined_picture` knows it.
    transfer_function
        Extinction and colour over physical values. At a jump the value itself belongs to the side above.
    box_from_clip
        [4, 4] from homogeneous clip coordinates to box space, as `Camera.box_from_clip` gives it.
    shape_hw
        Height and width of the picture in pixels.
    tolerance
        Error to aim at, at least 1e-13.

    Raises
    ------
    VolprepError
        VP6001 if a voxel is not finite: the field around it is not defined.
    ValueError
        If the volume does not have the grid's shape.
    """
    values, colours, extinctions_per_mm = native_function(transfer_function)
    picture = OraclePicture(rgba=np.empty((*shape_hw, 4)), bound=np.empty(shape_hw))
    _native.render_oracle(
        *native_field(volume),
        values,
        colours,
        extinctions_per_mm,
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        tolerance,
        picture.rgba,
        picture.bound,
        volume.nearest,
        *native_normals(volume.normals, volume.slope),
    )
    return picture


def native_field(volume: Volume) -> tuple[NDArray[np.generic], float, float, Vector, Vector]:
    """Return the arguments `volume`, `slope`, `intercept`, `spacing_mm_xyz` and `extent_mm_xyz` of native oracles.

    Raises the errors of `require_field`.
    """
    require_field(volume.stored, volume.grid)
    (hz, hy, hx), (z, y, x) = volume.grid.spacing_mm_zyx, volume.grid.extent_mm_zyx
    return volume.stored, volume.slope, volume.intercept, (hx, hy, hz), (x, y, z)


def native_function(function: TransferFunction) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the arguments `values`, `colours` and `extinctions_per_mm` of native oracles."""
    points = function.points
    return (
        np.array([point.value for point in points]),
        np.array([point.colour for point in points]),
        np.array([point.extinction_per_mm for point in points]),
    )


def oracle_of_media(
    media: Sequence[Medium],
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
) -> OraclePicture:
    """Draw several volumes into one picture: extinctions add, and each gives light as its extinction does.

    Each volume lies on its grid, and is empty beyond it; `box_from_clip` leads to the box of the first one. Gives the
    integral of Σ c τ exp(-∫ Σ τ), with a bound as `oracle_picture` gives it; volumes are lit as there. Errors as
    there.
    """
    volumes = [medium.volume for medium in media]
    types = {volume.stored.dtype for volume in volumes}
    # float32 holds each value of the other types.
    kind = types.pop() if len(types) == 1 else np.dtype(np.float32)
    fields = [np.ascontiguousarray(volume.stored, kind) for volume in volumes]
    for field, volume in zip(fields, volumes, strict=True):
        require_field(field, volume.grid)
    picture = OraclePicture(rgba=np.empty((*shape_hw, 4)), bound=np.empty(shape_hw))
    _native.render_oracle_sum(
        fields,
        [volume.slope for volume in volumes],
        [volume.intercept for volume in volumes],
        [function_rows(medium.transfer_function) for medium in media],
        [volume.grid.spacing_mm_zyx[::-1] for volume in volumes],
        [volume.grid.extent_mm_zyx[::-1] for volume in volumes],
        np.stack([_own_from_box(medium, volumes[0].grid) for medium in media]),
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        tolerance,
        picture.rgba,
        picture.bound,
        [native_normals(volume.normals, volume.slope) for volume in volumes],
    )
    return picture


def _own_from_box(medium: Medium, first: Grid) -> Float64Array:
    """Return the matrix [3, 4] from the box of the first volume to that of a medium."""
    grid = medium.volume.grid
    if grid == first and medium.placed is None:
        return np.eye(3, 4)
    moved = np.array([*medium.placed, (0.0, 0.0, 0.0, 1.0)]) if medium.placed is not None else np.eye(4)
    return np.linalg.solve(moved @ grid.world_from_box, first.world_from_box)[:3].astype(np.float64)


def function_rows(function: TransferFunction) -> Float64Array:
    """Return the control points as rows [n, 5]: value, linear RGB, extinction per millimetre."""
    return np.array([[point.value, *point.colour, point.extinction_per_mm] for point in function.points])
