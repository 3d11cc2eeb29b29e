"""First hit: the first place on the ray where the value is at least the isovalue, as if all such values were solid.

Where the box cuts it one sees the value there, as the transfer function shows it.
"""

import numpy as np

from volprep.compositing.surface import isovalue_of, next_values, surface
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def _visible(table: Table) -> Float64Array:
    _, after = next_values(table)
    return np.where(isovalue_of(table) < after, 1.0, 0.0)


FIRST_HIT = surface("first-hit", _visible, solid=True, truth="the first hit in the scan, at exact roots")
