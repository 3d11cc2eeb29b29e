"""Light that labels of a volume give, each alone: their extinction, integrated over their voxels.

Matter in front of a label does not count: a small segment inside a veil is as important as the veil, and an app may
hide what covers it. Divided by the same of the finest level, it is the *kept light* of the label. Of a thin label it is
1 if its voxels times their extinction are right, whatever its shape is.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

_SLAB_VOXELS = 2**22


def light_of_labels(  # noqa: PLR0917 - a field, its labels, and how they look
    stored: NDArray[np.generic],
    slope: float,
    intercept: float,
    labels: NDArray[np.uint16],
    functions: Sequence[TransferFunction],
    voxel_mm3: float,
) -> Float64Array:
    """Return the light of each label in mm².

    `stored` and `labels` are [z, y, x]; `functions` has an entry for each label, of physical values slope · stored +
    intercept.
    """
    distinct = list({function.name: function for function in functions}.values())
    style_of = np.array([distinct.index(function) for function in functions], np.intp)
    tables = [Table.exact(value) for value in distinct]
    light = np.zeros(len(functions))
    thickness = max(1, _SLAB_VOXELS // max(1, stored[0].size))

    def extinctions(values: NDArray[np.generic]) -> Float64Array:
        physical = slope * values.astype(np.float64) + intercept
        return np.stack([table.at(physical)[1] for table in tables])

    # Codes are few enough to look all of them up; sorting the voxels for those that occur took five times as long.
    codes = np.arange(2 ** (8 * stored.dtype.itemsize)) if stored.dtype in (np.uint8, np.uint16) else None
    of_code = None if codes is None else extinctions(codes)
    for z in range(0, len(stored), thickness):
        own, slab = labels[z : z + thickness].ravel(), stored[z : z + thickness]
        if of_code is not None:
            of_value, which = of_code, slab
        else:
            values, which = np.unique(slab, return_inverse=True)
            of_value = extinctions(values)
        light += np.bincount(own, of_value[style_of[own], which.ravel()], len(functions))
    return light * voxel_mm3
