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
    distinct = list({each.name: each for each in functions}.values())
    style_of = np.array([distinct.index(each) for each in functions], np.intp)
    tables = [Table.exact(each) for each in distinct]
    light = np.zeros(len(functions))
    thickness = max(1, _SLAB_VOXELS // max(1, stored[0].size))
    for z in range(0, len(stored), thickness):
        own = labels[z : z + thickness].ravel()
        values, which = np.unique(stored[z : z + thickness], return_inverse=True)
        physical = slope * values.astype(np.float64) + intercept
        extinctions = np.stack([table.at(physical)[1] for table in tables])
        light += np.bincount(own, extinctions[style_of[own], which.ravel()], len(functions))
    return light * voxel_mm3
