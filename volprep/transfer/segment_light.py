"""The exact light of a ray segment along which the value changes linearly (Engel, Kraus, Ertl 2001).

No feature of the transfer function between the two ends is missed, however narrow it is, and all attenuation inside the
segment counts. Plans measure tables and steps against it.
"""

import numpy as np

from volprep.kernels import _native
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def segment_light(
    table: Table, front: Float64Array, back: Float64Array, step_mm: float
) -> tuple[Float64Array, Float64Array]:
    """Colour [..., 3] and mean extinction [...] of segments of `step_mm` from physical values `front` to `back`.

    Colour is light divided by opacity, extinction is per millimetre.
    """
    front, back = np.broadcast_arrays(front, back)
    light = np.empty((front.size, 4))
    _native.preintegrate(
        np.ascontiguousarray(front, dtype=np.float64).ravel(),
        np.ascontiguousarray(back, dtype=np.float64).ravel(),
        *table.points,
        step_mm,
        light,
    )
    light = light.reshape(*front.shape, 4)
    return light[..., :3], light[..., 3]
