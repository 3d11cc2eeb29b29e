"""Pictures by refinement in float64, for lighting and compositing without a proven bound.

Each ray is refined until two halvings of its steps in a row change no channel by more than the tolerance
(native/src/oracle_refined.cpp). So the bound of a pixel is an estimate, the larger of these two changes.
"""

import numpy as np

from volprep.kernels import _native
from volprep.truth.lit import BakedField, Lit, light_numbers, native_normals, shadow_light
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture, native_field, native_function
from volprep.truth.path_traced import LitVolume
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction


def refined_picture(
    volume: Volume,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
    *,
    intensities: tuple[float, float] | None = None,
    baked: BakedField | None = None,
    planes: Float64Array | None = None,
) -> OraclePicture:
    """Draw a volume, lit by a light with a place where it has one; parameters and errors as `oracle_picture`.

    `baked` light multiplies the colours of the transfer function. With `intensities`, the values of the intensities 0
    and 1, the picture is of maximum intensity difference accumulation. `planes` [n, 4] in box space cut the volume: it
    ends where a·x + b·y + c·z + d falls below 0, in millimetres.
    """
    grid, normals = volume.grid, volume.normals
    picture = OraclePicture(rgba=np.empty((*shape_hw, 4)), bound=np.empty(shape_hw))
    kernel, vectors, slope_scale, halved = native_normals(normals, volume.slope)
    _native.render_refined(
        *native_field(volume),
        *native_function(transfer_function),
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        tolerance,
        picture.rgba,
        picture.bound,
        intensities,
        light_numbers(normals, grid),
        isinstance(normals, Lit) and normals.halfway,
        shadow_light(normals) is not None,
        kernel,
        vectors,
        slope_scale,
        halved,
        None if baked is None else baked.texels,
        None if baked is None else baked.curve,
        None if baked is None else baked.nodes_per_mm_xyz,
        (0.0, 0.0, 0.0) if baked is None else baked.start_mm(grid),
        planes,
    )
    return picture


def refined_lit(
    lit: LitVolume,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
    *,
    baked: BakedField | None,
) -> OraclePicture:
    """Draw what `traced_picture` draws, with a field of light in place of paths; without a field unlit."""
    return refined_picture(
        Volume(lit.volume, lit.grid, lit.slope, lit.intercept),
        lit.transfer_function,
        box_from_clip,
        shape_hw,
        tolerance,
        baked=baked,
        planes=lit.planes,
    )
