"""The picture that a projection should give, in float64, with a bound on its own error.

A projection shows one value for each ray: the greatest, the least, or the mean. The rules for the greatest
also hold for the others. The picture is the same as in VTK, 3D Slicer and DICOM workstations:

1. M is the greatest *physical* value of the trilinear field along the part of the pixel's ray that lies in the box.
   With a positive slope it is also the greatest stored value. With a negative slope it is the *least* stored value: a
   shader that reads stored values must take their minimum then.
2. The pixel is the transfer function's value at M, and at M alone. This is not the most opaque value on the ray: if
   the function hides the greatest values, they still win, and the pixel is transparent.
3. A maximum has no path length, so its opacity is that of a fixed length: alpha = 1 - exp(-extinction(M) · reference).
   The length belongs to the scene. It depends neither on the step nor on the level nor on the direction of the ray.
   The opacities of a scene have such a length already, and with the same one a control point gets the opacity that the
   scene states. The default is 1 mm, because extinctions are stated per millimetre.
4. The pixel is (colour(M) · alpha, alpha): premultiplied, linear light. A ray that misses the box is transparent.

For the usual grey picture of vessels, let the colour go from black to white over the window, and keep the opacity near
1 all over. Extinction, not opacity, is linear between control points: a ramp from opacity 0 to 1 is steep at its foot.
Colours are linear in light between control points: a ramp that is even on an sRGB screen needs several points.

In each cell between eight voxels the field along a ray is a cubic, whose maximum is at an end or at a root of its
derivative (native/src/oracle_maximum.cpp). Its integral is known, too (native/src/oracle_average.cpp). So both are
exact but for rounding. The least value is the negative of the greatest of the negated scan. The mean, which is the
integral divided by the length of the path, looks like an X-ray picture, whatever the depth of the volume; the mean of a
constant is the constant. Labels have no projection: the number of a label is not a quantity.
"""

from typing import Literal

import numpy as np

from volprep.kernels import _native
from volprep.truth.oracle import OraclePicture
from volprep.truth.shown import shown_picture
from volprep.truth.volume import Volume, require_field
from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction

Projection = Literal["maximum", "minimum", "average"]
"""Value of a ray that is shown."""

REFERENCE_MM = 1.0
"""The path whose opacity a value has where the scene states no length."""


def projected_picture(
    projection: Projection,
    volume: Volume,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    reference_mm: float = REFERENCE_MM,
) -> OraclePicture:
    """Draw one value along each pixel's ray, with a bound on the error of each pixel.

    The value is known up to some 1e-12 of the range of the voxels around it. The change of the transfer function
    over that interval is the pixel's bound: some 1e-12 for a smooth function. If a jump lies within the interval, the
    bound includes the whole jump, because the side of the value is unknown. Where all voxels around the ray are
    equal, it is exact, and a jump at this very value costs nothing.

    The bound does not cover the silhouette: whether a ray that touches the box within rounding hits it is decided in
    float64.

    Parameters
    ----------
    projection
        Which value of the ray counts.
    volume
        The field.
    transfer_function
        Extinction and colour over physical values. At a jump the value itself belongs to the side above.
    box_from_clip
        [4, 4] from homogeneous clip coordinates to box space, as `Camera.box_from_clip` gives it.
    shape_hw
        Height and width of the picture in pixels.
    reference_mm
        Length of the path whose opacity a value has.

    Raises
    ------
    VolprepError
        VP6001 if a voxel is not finite: the field around it is not defined.
    ValueError
        If the volume does not have the grid's shape, or the reference length is not above 0.
    """
    value, error = projected_values(projection, volume, box_from_clip, shape_hw)
    return shown_picture(value, error, transfer_function, reference_mm)


def projected_values(
    projection: Projection,
    volume: Volume,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    t_mm: Float64Array | None = None,
    tie: float = 0.0,
) -> tuple[Float64Array, Float64Array]:
    """Return one physical value for each ray, NaN if it misses the box, and a bound on its error.

    Both are [height, width]. The distance of a maximum from the near plane is written into `t_mm`: of
    maxima that differ by at most `tie`, the first one counts. Errors as in `projected_picture`.
    """
    grid = volume.grid
    require_field(volume.stored, grid)
    sign = -1.0 if projection == "minimum" else 1.0
    value, error = np.empty(shape_hw), np.empty(shape_hw)
    _native.render_projection(
        volume.stored,
        sign * volume.slope,
        sign * volume.intercept,
        grid.spacing_mm_zyx[::-1],
        grid.extent_mm_zyx[::-1],
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        "average" if projection == "average" else "maximum",
        value,
        error,
        t_mm,
        tie,
    )
    return sign * value, error
